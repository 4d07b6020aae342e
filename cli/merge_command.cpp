// SPDX-License-Identifier: Apache-2.0
// `axiscal merge` joins the partial outputs of `calibrate --stream --shard` in the order of the
// input.
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "core/formatted.hpp"
#include "stream_files.hpp"
#include "subcommands.hpp"
#include "usage_error.hpp"

namespace axiscal::cli {
namespace {

struct MergeCommand {
  std::vector<std::string> parts;
  std::string output;
};

void add_options(OptionSet& options, MergeCommand& command) {
  options.add("parts", command.parts, "PART",
              "files written by `calibrate --shard`: .jsonl, .jsonl.zst or .csv", Need::required);
  options.add("-o,--output", command.output, "FILE", "joined file, of the same type",
              Need::required);
}

// The line of a unit (one instrument), and the unit's index in the input.
struct NumberedLine {
  std::size_t unit = 0;
  std::string text;
};

NumberedLine numbered(const std::string& path, std::size_t line_number, std::string_view line) {
  constexpr std::string_view key = "{\"unit\":";
  const bool is_json = line.starts_with('{');
  const std::size_t from = is_json ? key.size() : 0;
  const std::size_t comma = line.find(',');
  if ((is_json && !line.starts_with(key)) || comma == std::string_view::npos ||
      line.find_first_not_of("0123456789", from) != comma) {
    throw DataError(path, line_number,
                    "this line does not begin with the number of a unit; `merge` joins only parts "
                    "that `calibrate --shard` has written");
  }
  return {.unit = static_cast<std::size_t>(
              std::strtoull(std::string(line.substr(from, comma - from)).c_str(), nullptr, 10)),
          .text = (is_json ? "{" : "") + std::string(line.substr(comma + 1))};
}

// The lines of one partial output. `next` is the index of the next line to write.
struct Part {
  std::string path;
  std::vector<NumberedLine> lines;  // in ascending order of units
  std::size_t next = 0;
};

int run(const MergeCommand& command) {
  std::vector<Part> parts;
  std::optional<std::string> header;
  for (const std::string& path : command.parts) {
    Part& part = parts.emplace_back(Part{.path = path, .lines = {}});
    const InputFile not_to_be_overwritten(path);
    std::size_t number = 0;
    read_complete_lines(path, [&](std::string_view line) {
      ++number;
      if (number == 1 && line.starts_with("unit,")) {
        const std::string own(line.substr(5));
        if (header && *header != own) {
          throw DataError(path, number, "the columns differ from those of the first part");
        }
        header = own;
        return true;
      }
      part.lines.push_back(numbered(path, number, line));
      return true;
    });
  }
  LineFile whole(command.output, 0);
  if (header) {
    whole.write(*header + "\n");
  }
  std::string pending;
  std::optional<std::size_t> last;
  for (;;) {
    Part* first = nullptr;
    for (Part& part : parts) {
      if (part.next < part.lines.size() &&
          (first == nullptr || part.lines[part.next].unit < first->lines[first->next].unit)) {
        first = &part;
      }
    }
    if (first == nullptr) {
      break;
    }
    const NumberedLine& line = first->lines[first->next++];
    if (last && line.unit <= *last) {
      throw RefusedError(
          formatted("{}: unit {} occurs twice; give each part only once", first->path, line.unit));
    }
    if (line.unit != (last ? *last + 1 : 0)) {
      throw RefusedError(
          formatted("unit {} is missing: a part is missing or incomplete", last ? *last + 1 : 0));
    }
    last = line.unit;
    pending += line.text + "\n";
    if (pending.size() > (1U << 20U)) {
      whole.write(pending);
      pending.clear();
    }
  }
  whole.write(pending);
  return 0;
}

}  // namespace

Subcommand merge_subcommand() {
  return make_subcommand<MergeCommand>("merge", "join the output files of calibrate --shard", "",
                                       &add_options, &run);
}

}  // namespace axiscal::cli
