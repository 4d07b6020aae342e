// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "logs/recordings/src/line_stream.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

// The parts of a line such as "X: 1.5 Y: -2 Z: 3 mg": pairs of a name and a number, and the unit at
// the end of the line.
struct Pairs {
  std::vector<std::string> names;
  std::vector<double> values;
  std::string unit;
};

// Adds the word before the first axis to the names of all axes. In "Accel X: 1 Y: 2 Z: 3", this
// word is "Accel".
void name_by_first(std::vector<std::string>& names) {
  if (names.size() < 2 || names.front().size() < 3) {
    return;
  }
  const std::size_t blank = names.front().rfind(' ');
  const bool are_letters = std::all_of(names.begin() + 1, names.end(),
                                       [](const std::string& name) { return name.size() == 1; });
  if (blank != std::string::npos && blank + 2 == names.front().size() && are_letters) {
    const std::string word = names.front().substr(0, blank + 1);
    for (auto name = names.begin() + 1; name != names.end(); ++name) {
      name->insert(0, word);
    }
  }
}

bool read_pairs(std::string_view line, Pairs& pairs) {
  std::vector<std::string>& names = pairs.names;
  std::vector<double>& values = pairs.values;
  names.clear();
  values.clear();
  pairs.unit.clear();
  std::size_t at = 0;
  constexpr std::string_view blanks = " \t,;|";
  for (;;) {
    at = line.find_first_not_of(blanks, at);
    if (at == std::string_view::npos) {
      name_by_first(names);
      return !names.empty();
    }
    const std::size_t mark = line.find_first_of(":=", at);
    if (mark == std::string_view::npos) {
      // The word after a number may be its unit: "X: 1.5 uT".
      pairs.unit = std::string(trimmed(line.substr(at)));
      name_by_first(names);
      return names.size() >= 2 && (known_unit(pairs.unit).has_value() ||
                                   pairs.unit.find_first_of("0123456789") == std::string::npos);
    }
    std::string_view name = trimmed(line.substr(at, mark - at));
    if (!names.empty() && name.find(' ') != std::string_view::npos) {
      name = trimmed(name.substr(name.rfind(' ')));  // removes the unit of the previous number
    }
    if (name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0) {
      return false;
    }
    const std::size_t first = line.find_first_not_of(" \t", mark + 1);
    if (first == std::string_view::npos) {
      return false;
    }
    const std::size_t end = std::min(line.find_first_of(" \t,;|", first), line.size());
    const std::optional<double> value = parse_number(line.substr(first, end - first));
    if (!value) {
      return false;
    }
    names.emplace_back(name);
    values.push_back(*value);
    at = end;
  }
}

constexpr std::string_view arrow = " -> ";

ByteSource without_arrows(ByteSource bytes) {
  return converted_lines(std::move(bytes), [](std::string_view line, std::string& text) {
    const std::size_t at = line.find(arrow);
    if (at != std::string_view::npos && at + arrow.size() < line.size()) {
      const std::string_view rest = trimmed(line.substr(at + arrow.size()));
      const char delimiter = rest.find(',') != std::string_view::npos    ? ','
                             : rest.find('\t') != std::string_view::npos ? '\t'
                             : rest.find(';') != std::string_view::npos  ? ';'
                                                                         : ' ';
      text = std::string(trimmed(line.substr(0, at))) + delimiter + std::string(rest);
    }
    text += '\n';
  });
}

// @return the line without its time stamp: "X: 1 Y: 2" for "14:08:06.818 -> X: 1 Y: 2".
std::string_view behind_arrow(std::string_view line) {
  const std::size_t at = line.find(arrow);
  return at == std::string_view::npos ? line : line.substr(at + arrow.size());
}

// A kind of line that an Arduino sketch prints repeatedly, such as "gx = 0.06 gy = -1.69 deg/s":
// the names and the unit in the line, and the number of such lines.
struct PrintedLine {
  std::vector<std::string> names;
  std::string unit;
  std::size_t count = 0;
};

// Finds the kinds of lines with pairs of a name and a number. Lines of one kind have the same
// names. The kinds are in the order of their first occurrence. A kind that occurs only once is left
// out, unless it is the only kind.
// @param others  receives the number of all other lines.
std::vector<PrintedLine> printed_lines(std::string_view start, bool is_whole, std::size_t& others) {
  std::vector<PrintedLine> lines;
  others = 0;
  Pairs pairs;
  while (!start.empty()) {
    const std::size_t end = std::min(start.find('\n'), start.size());
    const std::string_view line = trimmed(start.substr(0, end));
    start.remove_prefix(std::min(end + 1, start.size()));
    if (line.empty() || (start.empty() && !is_whole)) {
      continue;  // an incomplete last line is ignored
    }
    if (!read_pairs(behind_arrow(line), pairs) || pairs.names.size() < 2) {
      ++others;
      continue;
    }
    const auto known = std::find_if(lines.begin(), lines.end(), [&](const PrintedLine& one) {
      return one.names == pairs.names;
    });
    if (known == lines.end()) {
      lines.push_back({.names = pairs.names, .unit = pairs.unit, .count = 1});
    } else {
      ++known->count;
    }
  }
  const auto once = std::stable_partition(lines.begin(), lines.end(), [&](const PrintedLine& one) {
    return one.count > 1 || lines.size() == 1;
  });
  for (auto it = once; it != lines.end(); ++it) {
    others += it->count;
  }
  lines.erase(once, lines.end());
  return lines;
}

// Joins the lines of one sample into a row of the table. The row replaces the last of these lines.
class RowOfLines {
 public:
  explicit RowOfLines(std::vector<PrintedLine> lines)
      : lines_(std::move(lines)), cells_(lines_.size()) {}

  void convert(std::string_view line, std::string& text) {
    const std::size_t at = line.find(arrow);
    const bool has_stamp = at != std::string_view::npos;
    if (!read_pairs(behind_arrow(line), pairs_)) {
      text += '\n';
      return;
    }
    const auto own = std::find_if(lines_.begin(), lines_.end(), [&](const PrintedLine& one) {
      return one.names == pairs_.names;
    });
    if (own == lines_.end()) {
      text += '\n';
      return;
    }
    if (!has_header_) {
      has_header_ = true;
      text = (has_stamp ? "time," : "") + header() + '\n';
    }
    const auto place = static_cast<std::size_t>(own - lines_.begin());
    if (place == 0) {
      std::fill(cells_.begin(), cells_.end(), "");
      stamp_ = has_stamp ? std::string(trimmed(line.substr(0, at))) + ',' : "";
    }
    cells_[place].clear();
    for (const double value : pairs_.values) {
      cells_[place] += (cells_[place].empty() ? "" : ",") + number_text(value);
    }
    // A sample with a missing line gives no row.
    if (place + 1 == lines_.size() &&
        std::none_of(cells_.begin(), cells_.end(),
                     [](const std::string& cell) { return cell.empty(); })) {
      text += stamp_ + joined(cells_, ",");
    }
    text += '\n';
  }

 private:
  [[nodiscard]] std::string header() const {
    std::vector<std::string> names;
    for (const PrintedLine& line : lines_) {
      for (const std::string& name : line.names) {
        names.push_back(line.unit.empty() ? name : name + " (" + line.unit + ")");
      }
    }
    return joined(names, ",");
  }

  std::vector<PrintedLine> lines_;
  std::vector<std::string> cells_;  // values of each line of a sample; empty if missing
  std::string stamp_;
  bool has_header_ = false;
  Pairs pairs_;
};

ByteSource pairs_as_table(ByteSource bytes, std::vector<PrintedLine> lines) {
  return converted_lines(std::move(bytes), [row = RowOfLines(std::move(lines))](
                                               std::string_view line, std::string& text) mutable {
    row.convert(line, text);
  });
}

}  // namespace

ByteSource printed_lines_as_table(ByteSource bytes) {
  constexpr std::size_t looked_at = 8192;
  const std::string_view start = bytes.peek(looked_at);
  std::size_t others = 0;
  std::vector<PrintedLine> lines = printed_lines(start, start.size() < looked_at, others);
  std::size_t own = 0;
  for (const PrintedLine& line : lines) {
    own += line.count;
  }
  // Sketches may print other lines between the samples. The text is converted only if enough of its
  // lines consist of pairs of a name and a number: at least a quarter of all lines if a sample
  // consists of several lines, and more than half if it consists of one line.
  if (own > 0 && (lines.size() > 1 ? 3 * own >= others : own > others)) {
    return pairs_as_table(std::move(bytes), std::move(lines));
  }
  const bool are_stamped = are_most_lines(start, [](std::string_view line) {
    const std::size_t at = line.find(arrow);
    return at != std::string_view::npos && !std::isnan(clock_seconds(trimmed(line.substr(0, at))));
  });
  return are_stamped ? without_arrows(std::move(bytes)) : std::move(bytes);
}

}  // namespace axiscal
