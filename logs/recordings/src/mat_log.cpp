// SPDX-License-Identifier: Apache-2.0
// Reads MATLAB's .mat files of version 5 (level 5 MAT-file format, The MathWorks). Numeric vectors
// and matrices with the same number of rows form one table, and the largest table is read. matio is
// not used, because it trusts the sizes that a damaged file states. This reader compares each size
// with that of the enclosing element, and allocates memory only for bytes that it has read.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <utility>

#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/series_tables.hpp"
#include "logs/recordings/src/unpacker.hpp"

namespace axiscal {
namespace {

enum : std::uint32_t { matrix_element = 14, compressed_element = 15 };
enum : std::uint32_t { struct_class = 2, first_numeric_class = 6, last_numeric_class = 15 };

constexpr std::size_t piece = 1U << 16U;
constexpr int deepest = 16;  // largest depth of nested structures

// A source of bytes: the file itself, or data that are unpacked from it.
class Bytes {
 public:
  virtual ~Bytes() = default;
  // @return the number of bytes read, at most `size`; 0 at the end.
  virtual std::size_t read(char* buffer, std::size_t size) = 0;
};

class FileBytes final : public Bytes {
 public:
  explicit FileBytes(ByteSource& source) : source_(source) {}
  std::size_t read(char* buffer, std::size_t size) override { return source_.read(buffer, size); }

 private:
  ByteSource& source_;
};

class InflatedBytes final : public Bytes {
 public:
  // @param size  number of packed bytes.
  InflatedBytes(Bytes& packed, std::size_t size, ReadBudget budget)
      : packed_(packed),
        left_(size),
        budget_(std::move(budget)),
        unpacker_("zlib", [this](char* to, std::size_t most) { return read_packed(to, most); }) {}
  InflatedBytes(const InflatedBytes&) = delete;
  InflatedBytes& operator=(const InflatedBytes&) = delete;

  std::size_t read(char* buffer, std::size_t size) override {
    std::size_t count = 0;
    try {
      count = unpacker_.read(buffer, std::min(size, piece));
    } catch (const DamagedStream&) {
      return 0;  // the caller reports the missing bytes
    }
    budget_.spend(ReadCost::unpacked, count);
    return count;
  }

  // Skips the packed bytes that were not read.
  void skip_rest() {
    std::vector<char> skipped(piece);
    while (read_packed(skipped.data(), skipped.size()) > 0) {
    }
  }

 private:
  std::size_t read_packed(char* buffer, std::size_t most) {
    const std::size_t count = packed_.read(buffer, std::min(left_, most));
    left_ -= count;
    return count;
  }

  Bytes& packed_;
  std::size_t left_;
  ReadBudget budget_;
  Unpacker unpacker_;
};

struct Tag {
  std::uint32_t type = 0;
  std::size_t size = 0;               // size of the data in bytes
  std::optional<std::string> inside;  // data of a small element, which are stored in the tag
};

// @return the size of a number of this data type in bytes; 0 if the type is not numeric.
std::size_t size_of_type(std::uint32_t type) {
  constexpr std::array<std::size_t, 14> sizes = {0, 1, 1, 2, 2, 4, 4, 4, 0, 8, 0, 0, 8, 8};
  return type < sizes.size() ? sizes[type] : 0;
}

class MatReader {
 public:
  explicit MatReader(ByteSource source) : source_(std::move(source)), file_(source_) {}

  std::unique_ptr<LogFile::Source> read() {
    constexpr std::size_t header_size = 128;
    const std::string header = read_exactly(file_, header_size);
    const std::string_view order = std::string_view(header).substr(126, 2);
    if (order != "IM" && order != "MI") {
      fail("the header does not state the byte order");
    }
    swapped_ = (order == "IM") != (std::endian::native == std::endian::little);
    for (;;) {
      std::array<char, 8> start{};
      const std::size_t count = file_.read(start.data(), 1);
      if (count == 0) {
        break;
      }
      const std::string rest = read_exactly(file_, 7);
      std::copy(rest.begin(), rest.end(), start.begin() + 1);
      read_element(number<std::uint32_t>(start.data()), number<std::uint32_t>(&start[4]));
    }
    return std::move(tables_).largest(source_.path());
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw DataError(source_.path(), "the .mat file is damaged or cut short: " + why);
  }

  void read_element(std::uint32_t type, std::size_t size) {
    if (type == matrix_element) {
      read_matrix(file_, size, "", 0);
    } else if (type == compressed_element) {
      read_compressed(size);
    } else {
      skip(file_, size);
    }
  }

  void read_compressed(std::size_t size) {
    InflatedBytes bytes(file_, size, source_.budget().within());
    const std::string start = read_exactly(bytes, 8);
    if (number<std::uint32_t>(start.data()) == matrix_element) {
      read_matrix(bytes, number<std::uint32_t>(start.data() + 4), "", 0);
    }
    bytes.skip_rest();
  }

  std::string read_exactly(Bytes& bytes, std::size_t size) const {
    std::string text =
        read_up_to(size, [&](char* buffer, std::size_t most) { return bytes.read(buffer, most); });
    if (text.size() < size) {
      fail(formatted("an element should have {} bytes, but has {}", size, text.size()));
    }
    return text;
  }

  void skip(Bytes& bytes, std::size_t size) const {
    std::array<char, 4096> buffer{};
    while (size > 0) {
      const std::size_t count = bytes.read(buffer.data(), std::min(size, buffer.size()));
      if (count == 0) {
        fail("an element is incomplete");
      }
      size -= count;
    }
  }

  template <typename Number>
  [[nodiscard]] Number number(const char* bytes) const {
    std::array<char, sizeof(Number)> own{};
    std::copy_n(bytes, sizeof(Number), own.begin());
    if (swapped_) {
      std::reverse(own.begin(), own.end());
    }
    return std::bit_cast<Number>(own);
  }

  [[nodiscard]] double value(const char* bytes, std::uint32_t type) const {
    switch (type) {
      case 1:
        return number<std::int8_t>(bytes);
      case 2:
        return number<std::uint8_t>(bytes);
      case 3:
        return number<std::int16_t>(bytes);
      case 4:
        return number<std::uint16_t>(bytes);
      case 5:
        return number<std::int32_t>(bytes);
      case 6:
        return number<std::uint32_t>(bytes);
      case 7:
        return static_cast<double>(number<float>(bytes));
      case 9:
        return number<double>(bytes);
      case 12:
        return static_cast<double>(number<std::int64_t>(bytes));
      default:
        return static_cast<double>(number<std::uint64_t>(bytes));
    }
  }

  // Reads the tag of the next part of an element.
  // @param left  number of bytes that remain in the element; reduced by the size of the tag.
  Tag read_tag(Bytes& bytes, std::size_t& left) const {
    if (left < 8) {
      fail("an element ends within the tag of a part");
    }
    const std::string start = read_exactly(bytes, 8);
    left -= 8;
    const auto first = number<std::uint32_t>(start.data());
    if ((first >> 16U) != 0) {  // small: the data are in the tag
      Tag tag{.type = first & 0xFFFFU, .size = first >> 16U};
      if (tag.size > 4) {
        fail(formatted("a small element has {} bytes", tag.size));
      }
      tag.inside = start.substr(4, tag.size);
      return tag;
    }
    Tag tag{.type = first, .size = number<std::uint32_t>(start.data() + 4)};
    if (tag.size > left) {
      fail(formatted("a part of {} bytes is in an element with {} bytes left", tag.size, left));
    }
    return tag;
  }

  // Reads the data of a part, and the padding up to the next multiple of 8 bytes.
  std::string read_data(Bytes& bytes, const Tag& tag, std::size_t& left) const {
    if (tag.inside) {
      return *tag.inside;
    }
    std::string data = read_exactly(bytes, tag.size);
    left -= tag.size;
    const std::size_t padding = std::min((8 - tag.size % 8) % 8, left);
    skip(bytes, padding);
    left -= padding;
    return data;
  }

  std::string read_part(Bytes& bytes, std::size_t& left) const {
    const Tag tag = read_tag(bytes, left);
    return read_data(bytes, tag, left);
  }

  void read_matrix(Bytes& bytes, std::size_t left, const std::string& outer, int depth) {
    const std::string flags = read_part(bytes, left);
    if (flags.size() < 8) {
      fail("a variable lacks its flags");
    }
    const auto all_flags = number<std::uint32_t>(flags.data());
    const std::uint32_t kind = all_flags & 0xFFU;
    const bool is_complex = (all_flags & 0x0800U) != 0;
    const bool is_numeric = kind >= first_numeric_class && kind <= last_numeric_class;
    if (kind != struct_class && !is_numeric) {
      skip(bytes, left);  // text, cells and objects are not read
      return;
    }
    const std::string sizes = read_part(bytes, left);
    const std::string own_name = read_part(bytes, left);
    if (sizes.size() % 4 != 0) {
      fail("a variable lacks its sizes");
    }
    const std::string name = outer.empty() ? own_name : outer;
    std::vector<std::int32_t> dimensions;
    for (std::size_t i = 0; i < sizes.size(); i += 4) {
      dimensions.push_back(number<std::int32_t>(sizes.data() + i));
    }
    const bool has_elements = std::all_of(dimensions.begin(), dimensions.end(),
                                          [](std::int32_t size) { return size > 0; });
    const bool is_table = dimensions.size() == 2 && has_elements;
    // MATLAB stores internal data of objects in variables without a name.
    if (name.empty()) {
      skip(bytes, left);
      return;
    }
    if (kind == struct_class && has_elements && depth < deepest) {
      read_fields(bytes, left, name, depth);  // in an array, only the first structure is read
    } else if (is_numeric && is_table && !is_complex) {
      read_numbers(bytes, left, name, static_cast<std::size_t>(dimensions[0]),
                   static_cast<std::size_t>(dimensions[1]));
    }
    skip(bytes, left);
  }

  void read_fields(Bytes& bytes, std::size_t& left, const std::string& name, int depth) {
    const std::string length = read_part(bytes, left);
    const std::string names = read_part(bytes, left);
    if (length.size() < 4) {
      fail("a structure does not state the length of its fields' names");
    }
    const auto longest = number<std::int32_t>(length.data());
    if (names.empty()) {
      return;  // a structure without fields
    }
    if (longest < 1 || names.size() % static_cast<std::size_t>(longest) != 0) {
      fail("the fields of a structure cannot be read");
    }
    const auto step = static_cast<std::size_t>(longest);
    for (std::size_t at = 0; at < names.size(); at += step) {
      const std::string field = names.substr(at, step).c_str();  // up to the first NUL
      const Tag tag = read_tag(bytes, left);
      if (tag.inside || tag.type != matrix_element) {
        fail("a structure's field is not a variable");
      }
      if (tag.size > 0) {
        read_matrix(bytes, tag.size, formatted("{}.{}", name, field), depth + 1);
        left -= tag.size;
      }
    }
  }

  void read_numbers(Bytes& bytes,
                    std::size_t& left,
                    const std::string& name,
                    std::size_t rows,
                    std::size_t columns) {
    const Tag tag = read_tag(bytes, left);
    const std::size_t width = size_of_type(tag.type);
    // `rows` and `columns` come from positive 32-bit numbers, so their product does not overflow.
    if (width == 0 || tag.size % width != 0 || tag.size / width != rows * columns) {
      fail(formatted("variable '{}' is {} x {}, but has {} bytes of numbers", name, rows, columns,
                     tag.size));
    }
    const std::string data = read_data(bytes, tag, left);
    // Memory is needed for `data`, for `values`, and for the columns into which add() copies them.
    source_.budget().spend(ReadCost::memory, rows * columns * (width + 2 * sizeof(double)));
    source_.budget().spend(ReadCost::cells, rows * columns);
    std::vector<double> values(rows * columns);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = value(data.data() + i * width, tag.type);
    }
    tables_.add(name, rows, columns, values);
  }

  ByteSource source_;
  FileBytes file_;
  bool swapped_ = false;
  SeriesTables tables_;
};

}  // namespace

std::unique_ptr<LogFile::Source> open_mat_log(ByteSource bytes) {
  return MatReader(std::move(bytes)).read();
}

}  // namespace axiscal
