// SPDX-License-Identifier: Apache-2.0
// NumPy's .npy files (format versions 1 to 3): arrays of numbers with one or two dimensions, and
// arrays of records.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/log_source.hpp"

namespace axiscal {
namespace {

// An array is refused if its number of rows and its number of columns are both larger than this.
constexpr std::size_t most_columns = 10000;

struct NpyType {
  char kind = 'f';       // NumPy's letter: i, u, f or b
  std::size_t size = 8;  // size of a number in bytes
  bool swapped = false;
};

template <typename Number>
double as_double(const char* bytes, std::size_t size, bool swapped) {
  std::array<char, 8> copy{};
  std::memcpy(copy.data(), bytes, size);
  if (swapped) {
    std::reverse(copy.begin(), copy.begin() + static_cast<std::ptrdiff_t>(size));
  }
  Number value{};
  std::memcpy(&value, copy.data(), sizeof value);
  return static_cast<double>(value);
}

double value_at(const char* bytes, const NpyType& type) {
  const bool s = type.swapped;
  switch (type.kind) {
    case 'f':
      return type.size == 8 ? as_double<double>(bytes, 8, s) : as_double<float>(bytes, 4, s);
    case 'i':
      return type.size == 8   ? as_double<std::int64_t>(bytes, 8, s)
             : type.size == 4 ? as_double<std::int32_t>(bytes, 4, s)
             : type.size == 2 ? as_double<std::int16_t>(bytes, 2, s)
                              : as_double<std::int8_t>(bytes, 1, s);
    default:
      return type.size == 8   ? as_double<std::uint64_t>(bytes, 8, s)
             : type.size == 4 ? as_double<std::uint32_t>(bytes, 4, s)
             : type.size == 2 ? as_double<std::uint16_t>(bytes, 2, s)
                              : as_double<std::uint8_t>(bytes, 1, s);
  }
}

// The header is a Python dictionary: {'descr': '<f8', 'fortran_order': False, 'shape': (10, 3), }.
class NpyHeader {
 public:
  NpyHeader(const std::string& path, std::string text) : path_(path), text_(std::move(text)) {
    read_types(after("'descr':"));
    fortran_order = after("'fortran_order':").starts_with("True");
    read_shape(after("'shape':"));
  }

  std::vector<NpyType> types;      // one type for all numbers, or one for each field of a record
  std::vector<std::string> names;  // names of a record's fields
  bool fortran_order = false;
  std::size_t rows = 0;
  std::size_t columns = 1;

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw DataError(path_, "the .npy array " + why);
  }

  [[nodiscard]] std::string_view after(std::string_view key) const {
    const std::size_t at = text_.find(key);
    if (at == std::string::npos) {
      fail("header lacks " + std::string(key));
    }
    return trimmed(std::string_view(text_).substr(at + key.size()));
  }

  [[nodiscard]] NpyType type_of(std::string_view descr) const {
    if (descr.size() < 3) {
      fail("has an unknown type");
    }
    NpyType type{.kind = descr[1],
                 .size = static_cast<std::size_t>(parse_integer(descr.substr(2)).value_or(0))};
    const bool big = descr.front() == '>';
    type.swapped = type.size > 1 && big != (std::endian::native == std::endian::big);
    const bool known =
        type.kind == 'f'
            ? type.size == 8 || type.size == 4
            : std::string_view("iub").find(type.kind) != std::string_view::npos &&
                  (type.size == 1 || type.size == 2 || type.size == 4 || type.size == 8);
    if (!known) {
      fail(formatted("contains '{}'; only integers and floats of 4 or 8 bytes can be read", descr));
    }
    return type;
  }

  static std::string_view quoted(std::string_view text, std::size_t from, std::size_t& end) {
    const std::size_t open = text.find('\'', from);
    const std::size_t close = open == std::string_view::npos ? open : text.find('\'', open + 1);
    if (close == std::string_view::npos) {
      return {};
    }
    end = close + 1;
    return text.substr(open + 1, close - open - 1);
  }

  void read_types(std::string_view descr) {
    std::size_t at = 0;
    if (!descr.starts_with("[")) {
      types.push_back(type_of(quoted(descr, 0, at)));
      return;
    }
    const std::string_view fields = descr.substr(0, descr.find(']'));
    for (std::size_t from = 1; fields.find('(', from) != std::string_view::npos;) {
      const std::string_view name = quoted(fields, from, from);
      const std::string_view type = quoted(fields, from, from);
      if (name.empty() || type.empty()) {
        fail("has records that cannot be read");
      }
      names.emplace_back(name);
      types.push_back(type_of(type));
    }
    if (types.empty()) {
      fail("has records without fields");
    }
    columns = types.size();
  }

  void read_shape(std::string_view shape) {
    const std::size_t end = shape.find(')');
    if (!shape.starts_with('(') || end == std::string_view::npos) {
      fail("has no shape");
    }
    std::vector<std::size_t> sizes;
    for (const std::string_view part : split(shape.substr(1, end - 1), ',')) {
      if (!trimmed(part).empty()) {
        const std::optional<double> size = parse_number(trimmed(part));
        constexpr double most = 1e15;  // more numbers than a disk can store
        if (!size || !(*size >= 0.0 && *size <= most) || *size != std::floor(*size)) {
          fail("has no shape");
        }
        sizes.push_back(static_cast<std::size_t>(*size));
      }
    }
    if (sizes.empty() || sizes.size() > 2 || (sizes.size() == 2 && !names.empty())) {
      fail("must have one dimension or two");
    }
    rows = sizes[0];
    if (sizes.size() == 2) {
      columns = sizes[1];
    }
    if (std::min(rows, columns) > most_columns) {
      fail(formatted("has {} columns, more than {}", columns, most_columns));
    }
  }

  const std::string& path_;
  std::string text_;
};

class NpyLog : public LogFile::Source {
 public:
  NpyLog(ByteSource bytes, NpyHeader header, std::vector<std::string> names)
      : bytes_(std::move(bytes)), header_(std::move(header)) {
    columns = std::move(names);
    rows = header_.rows;
    for (std::size_t c = 0; c < header_.columns; ++c) {
      offsets_.push_back(row_size_);
      row_size_ += type(c).size;
    }
    std::vector<std::size_t> all(columns.size());
    for (std::size_t c = 0; c < all.size(); ++c) {
      all[c] = c;
    }
    selected_ = all;
  }

  void select(const std::vector<std::size_t>& selected) override { selected_ = selected; }

  std::size_t read(LogBlock& block, std::size_t most) override {
    // About 1 MiB is read at once, so that false sizes in a header cannot cause a large allocation.
    constexpr std::size_t block_size = 1U << 20U;
    const std::size_t wanted =
        std::min({most, header_.rows - done_, std::max<std::size_t>(block_size / row_size_, 1)});
    raw_.resize(wanted * row_size_);
    const std::size_t got = fill(raw_) / row_size_;
    if (got < wanted) {
      throw DataError(bytes_.path(), formatted("the .npy array is cut short: {} of {} rows",
                                               done_ + got, header_.rows));
    }
    block.assign(selected_.size(), std::vector<double>(got));
    for (std::size_t s = 0; s < selected_.size(); ++s) {
      for (std::size_t row = 0; row < got; ++row) {
        block[s][row] =
            value_at(&raw_[row * row_size_ + offsets_[selected_[s]]], type(selected_[s]));
      }
    }
    done_ += got;
    return got;
  }

 private:
  [[nodiscard]] const NpyType& type(std::size_t column) const {
    return header_.types[header_.types.size() > 1 ? column : 0];
  }

  std::size_t fill(std::vector<char>& to) {
    std::size_t filled = 0;
    while (filled < to.size()) {
      const std::size_t count = bytes_.read(to.data() + filled, to.size() - filled);
      if (count == 0) {
        break;
      }
      filled += count;
    }
    return filled;
  }

  ByteSource bytes_;
  NpyHeader header_;
  std::vector<std::size_t> offsets_;
  std::size_t row_size_ = 0;
  std::size_t done_ = 0;
  std::vector<std::size_t> selected_;
  std::vector<char> raw_;
};

std::string read_exactly(ByteSource& bytes, std::size_t size) {
  std::string text =
      read_up_to(size, [&](char* buffer, std::size_t most) { return bytes.read(buffer, most); });
  if (text.size() < size) {
    throw DataError(bytes.path(), "the .npy file is cut short");
  }
  return text;
}

}  // namespace

std::unique_ptr<LogFile::Source> open_npy_log(ByteSource bytes,
                                              const std::vector<std::string>& names) {
  const std::string start = read_exactly(bytes, 8);
  const std::size_t length_bytes = start[6] == '\1' ? 2 : 4;
  const std::string length_text = read_exactly(bytes, length_bytes);
  std::size_t length = 0;
  for (std::size_t i = 0; i < length_bytes; ++i) {
    length |= static_cast<std::size_t>(static_cast<unsigned char>(length_text[i])) << (8U * i);
  }
  if (length > (1U << 20U)) {
    throw DataError(bytes.path(), "the .npy header is damaged");
  }
  const std::string path = bytes.path();
  NpyHeader header(path, read_exactly(bytes, length));
  if (header.rows == 0 || header.columns == 0) {
    throw DataError(path, "the .npy array is empty");
  }
  const ReadBudget budget = bytes.budget();
  const double numbers = static_cast<double>(header.rows) * static_cast<double>(header.columns);
  // Below this limit, products of sizes do not overflow either.
  constexpr double no_disk_holds = 1e15;
  if (numbers > no_disk_holds) {
    throw DataError(path, "the .npy file is cut short");
  }
  // If the array has few but long rows, each row is assumed to be a series of samples.
  constexpr std::size_t most_series = 64;
  const bool is_transposed =
      header.names.empty() && (header.columns > most_columns ||
                               (header.rows <= most_series && header.columns > most_series &&
                                header.columns > 4 * header.rows));
  if (is_transposed) {
    const bool by_column = header.fortran_order;
    const std::size_t series = header.rows;
    const std::size_t samples = header.columns;
    const NpyType& type = header.types[0];
    const std::string raw = read_exactly(bytes, series * samples * type.size);
    budget.spend(ReadCost::memory, series * samples * (type.size + sizeof(double)));
    LogBlock data(series, std::vector<double>(samples));
    for (std::size_t s = 0; s < series; ++s) {
      for (std::size_t i = 0; i < samples; ++i) {
        const std::size_t at = by_column ? i * series + s : s * samples + i;
        data[s][i] = value_at(&raw[at * type.size], type);
      }
    }
    return std::make_unique<LogInMemory>(column_names(path, {}, series), std::move(data));
  }
  std::vector<std::string> columns = header.names.empty() || !names.empty()
                                         ? column_names(path, names, header.columns)
                                         : header.names;
  if (!header.fortran_order || header.columns == 1) {
    return std::make_unique<NpyLog>(std::move(bytes), std::move(header), std::move(columns));
  }
  LogBlock data(header.columns);
  for (std::vector<double>& column : data) {
    const std::string raw = read_exactly(bytes, header.rows * header.types[0].size);
    budget.spend(ReadCost::memory, header.rows * sizeof(double));
    column.resize(header.rows);
    for (std::size_t row = 0; row < header.rows; ++row) {
      column[row] = value_at(&raw[row * header.types[0].size], header.types[0]);
    }
  }
  return std::make_unique<LogInMemory>(std::move(columns), std::move(data));
}

}  // namespace axiscal
