// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>

#include <nlohmann/json.hpp>

#include "acquisition/src/decoder.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/text_row.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t longest_line = 1U << 16U;

std::vector<Channel> channels_of(const std::vector<std::string>& names) {
  std::vector<Channel> channels;
  for (const std::string& name : names) {
    channels.push_back(channel_of(name));
  }
  return channels;
}

// Splits bytes into lines. A line longer than longest_line is dropped and counted as a defect.
class LineDecoder : public Decoder {
 public:
  void decode(std::string_view bytes, const DecoderSink& sink) final {
    while (!bytes.empty()) {
      const std::size_t end = bytes.find_first_of("\r\n");
      if (end == std::string_view::npos) {
        held_.append(bytes);
        if (held_.size() > longest_line) {
          held_.clear();
          cut_ = true;
        }
        return;
      }
      held_.append(bytes.substr(0, end));
      bytes.remove_prefix(end + 1);
      if (cut_) {
        cut_ = false;
        sink.defect();
      } else if (!is_comment_line(held_)) {
        line(held_, std::exchange(midway_, false), sink);
      }
      held_.clear();
    }
  }

  void restart(bool midway) final {
    held_.clear();
    cut_ = false;
    midway_ = midway;
  }

 protected:
  // @param midway  true if the beginning of the line may be missing.
  virtual void line(std::string_view text, bool midway, const DecoderSink& sink) = 0;

  std::vector<double> values_;

 private:
  std::string held_;
  bool cut_ = false;
  bool midway_ = false;
};

class DelimitedDecoder final : public LineDecoder {
 public:
  explicit DelimitedDecoder(const std::vector<std::string>& names) {
    channels_ = channels_of(names);
    has_names_ = !names.empty();
  }

 private:
  void line(std::string_view text, bool midway, const DecoderSink& sink) override {
    find_delimiter(text);
    const std::vector<std::string_view> cells = cells_of(without_checksum(text), delimiter_);
    values_.clear();
    std::size_t numbers = 0;
    for (const std::string_view cell : cells) {
      values_.push_back(cell_number(cell, delimiter_ == ';' || delimiter_ == '\t'));
      numbers += std::isfinite(values_.back()) ? 1U : 0U;
    }
    if (numbers == 0) {
      header(cells, sink);
    } else if (midway) {
      return;  // the first cell may be incomplete
    } else if (channels_.empty()) {
      without_header(sink);
    } else if (cells.size() != channels_.size()) {
      sink.defect();
      if (from_header_ && !confirmed_) {  // the first line was not a header
        channels_.clear();
        has_names_ = false;
        delimiter_ = '\0';
      }
    } else {
      confirmed_ = true;
      sink.sample(values_);
    }
  }

  void find_delimiter(std::string_view text) {
    if (delimiter_ == '\0') {
      const std::size_t at = text.find_first_of(";\t,");
      delimiter_ = text.find(';') != std::string_view::npos ? ';'
                   : at != std::string_view::npos           ? text[at]
                                                            : ' ';
    }
  }

  void header(const std::vector<std::string_view>& cells, const DecoderSink& sink) {
    const bool named = std::all_of(cells.begin(), cells.end(), [](std::string_view cell) {
      const std::string_view name = cell_name(cell);
      return !name.empty() && name.size() < 64 &&
             std::all_of(name.begin(), name.end(), [](char c) { return c >= ' ' && c < '\x7f'; });
    });
    if (!named || (has_names_ && cells.size() != channels_.size())) {
      delimiter_ = channels_.empty() ? '\0' : delimiter_;
      sink.defect();
      return;
    }
    if (channels_.empty()) {
      for (const std::string_view cell : cells) {
        channels_.push_back(channel_of(cell_name(cell)));
      }
      has_names_ = true;
      from_header_ = true;
    }
  }

  // Defines the channels when two consecutive lines have the same number of cells. One line is not
  // enough, because the first line may be incomplete.
  void without_header(const DecoderSink& sink) {
    if (waiting_.size() != values_.size()) {
      waiting_ = values_;
      return;
    }
    for (std::size_t i = 0; i < values_.size(); ++i) {
      channels_.push_back({.name = formatted("c{}", i + 1), .unit = ""});
    }
    sink.sample(waiting_);
    sink.sample(values_);
  }

  char delimiter_ = '\0';
  bool has_names_ = false;
  bool from_header_ = false;
  bool confirmed_ = false;  // true after a line had one cell for each name
  std::vector<double> waiting_;
};

class JsonDecoder final : public LineDecoder {
 public:
  explicit JsonDecoder(const std::vector<std::string>& names) { channels_ = channels_of(names); }

 private:
  void line(std::string_view text, bool /*midway*/, const DecoderSink& sink) override {
    const nlohmann::ordered_json object = nlohmann::ordered_json::parse(text, nullptr, false);
    if (!object.is_object()) {
      sink.defect();
      return;
    }
    found_.clear();
    flatten(object, "");
    if (channels_.empty()) {
      for (const auto& [name, value] : found_) {
        channels_.push_back({.name = name, .unit = ""});
      }
    }
    values_.assign(channels_.size(), not_a_number);
    bool some = false;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      for (const auto& [name, value] : found_) {
        if (name == channels_[i].name) {
          values_[i] = value;
          some = true;
        }
      }
    }
    some ? sink.sample(values_) : sink.defect();
  }

  // Appends all numbers to found_, named by their paths: {"acc": {"x": 1}, "gyro": [2, 3]} gives
  // acc.x, gyro.0 and gyro.1.
  void flatten(const nlohmann::ordered_json& value, const std::string& name) {
    if (value.is_number()) {
      found_.emplace_back(name, value.get<double>());
    } else if (value.is_object()) {
      for (const auto& [key, member] : value.items()) {
        flatten(member, name.empty() ? key : formatted("{}.{}", name, key));
      }
    } else if (value.is_array()) {
      for (std::size_t i = 0; i < value.size(); ++i) {
        flatten(value[i], formatted("{}.{}", name, i));
      }
    }
  }

  std::vector<std::pair<std::string, double>> found_;
};

// Reads lines by a pattern such as "X={x} Y={y}". {x} stands for a number, the value of channel x.
// {} stands for a number that is skipped. Other text is literal.
class PatternDecoder final : public LineDecoder {
 public:
  explicit PatternDecoder(const SourceAddress& address) {
    const std::string pattern = address.text_or("pattern", "");
    std::size_t at = 0;
    while (at < pattern.size()) {
      const std::size_t open = std::min(pattern.find('{', at), pattern.size());
      const std::size_t close = pattern.find('}', open);
      if (open < pattern.size() && close == std::string::npos) {
        address.fail(formatted("pattern={}: a {{ without a matching }}", pattern));
      }
      pieces_.push_back({.before = pattern.substr(at, open - at)});
      if (open == pattern.size()) {
        break;
      }
      pieces_.back().is_field = true;
      const std::string name = pattern.substr(open + 1, close - open - 1);
      if (!name.empty()) {
        pieces_.back().channel = static_cast<int>(channels_.size());
        channels_.push_back(channel_of(name));
      }
      at = close + 1;
    }
    if (channels_.empty()) {
      address.fail("pattern= must name the numbers in a line, for example \"X={x} Y={y} Z={z}\"");
    }
  }

 private:
  struct Piece {
    std::string before;
    bool is_field = false;
    int channel = -1;
  };

  void line(std::string_view text, bool /*midway*/, const DecoderSink& sink) override {
    values_.assign(channels_.size(), not_a_number);
    bool first = true;
    for (const Piece& piece : pieces_) {
      const std::string_view before =
          first ? std::string_view(piece.before) : trimmed(piece.before);
      const std::size_t at = text.find(first ? trimmed(before) : before);
      const bool joins =
          at != std::string_view::npos &&
          (first || text.substr(0, at).find_first_not_of(" \t") == std::string_view::npos);
      if (!joins) {
        sink.defect();
        return;
      }
      text.remove_prefix(at + trimmed(before).size());
      first = false;
      if (!piece.is_field) {
        continue;
      }
      text.remove_prefix(std::min(text.find_first_not_of(" \t+"), text.size()));
      double value = 0.0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error != std::errc{} || !std::isfinite(value)) {
        sink.defect();
        return;
      }
      text.remove_prefix(static_cast<std::size_t>(end - text.data()));
      if (piece.channel >= 0) {
        values_[static_cast<std::size_t>(piece.channel)] = value;
      }
    }
    sink.sample(values_);
  }

  std::vector<Piece> pieces_;
};

}  // namespace

Channel channel_of(std::string_view text) {
  const std::string_view whole = trimmed(text);
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    const std::size_t at = whole.find(open);
    if (at != std::string_view::npos && at > 0 && whole.back() == close) {
      return {.name = std::string(trimmed(whole.substr(0, at))),
              .unit = std::string(trimmed(whole.substr(at + 1, whole.size() - at - 2)))};
    }
  }
  return {.name = std::string(whole), .unit = ""};
}

const std::vector<std::string>& decoder_options() {
  static const std::vector<std::string> options = {"format", "names", "pattern", "frame"};
  return options;
}

std::unique_ptr<Decoder> make_decoder(const SourceAddress& address) {
  const std::string otherwise = address.find("pattern") ? "pattern"
                                : address.find("frame") ? "frames"
                                                        : "delimited";
  const std::string format = address.text_or("format", otherwise);
  if (format == "delimited") {
    return std::make_unique<DelimitedDecoder>(address.names("names"));
  }
  if (format == "json") {
    return std::make_unique<JsonDecoder>(address.names("names"));
  }
  if (format == "pattern") {
    return std::make_unique<PatternDecoder>(address);
  }
  if (format == "frames") {
    const std::string path = address.text_or("frame", "");
    if (path.empty()) {
      address.fail("format=frames needs frame=FILE.json");
    }
    return make_frame_decoder(path);
  }
  address.fail(formatted("format={}: expected delimited, json, pattern or frames", format));
}

}  // namespace axiscal
