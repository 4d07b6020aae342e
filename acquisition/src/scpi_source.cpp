// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "acquisition/src/decoder.hpp"
#include "acquisition/src/device_sources.hpp"
#include "acquisition/src/sample_clock.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/text_row.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr double overload = 9.9e37;  // reply for a reading beyond the range (SCPI-99, 7.2.1)
constexpr double longest_answer_s = 10.0;
constexpr std::size_t longest_reply = 1U << 16U;

// Returns the shunt resistance of each channel [ohm]; 0 if the channel measures a voltage. The
// option `resistor` states one value for all channels, or one value for each channel.
std::vector<double> resistors_of(const SourceAddress& address, std::size_t channels) {
  const std::optional<std::string> text = address.find("resistor");
  if (!text) {
    return std::vector<double>(channels, 0.0);
  }
  constexpr double largest = 1e12;
  const std::optional<std::vector<double>> stated = parse_numbers(*text);
  if (!stated || (stated->size() != 1 && stated->size() != channels) ||
      std::any_of(stated->begin(), stated->end(),
                  [](double r) { return !(r >= 0.0 && r <= largest); })) {
    address.fail(
        formatted("resistor={}: must be one resistance in ohms, or one for each of the {} "
                  "channels; 0 means no resistor",
                  *text, channels));
  }
  return stated->size() == 1 ? std::vector<double>(channels, stated->front()) : *stated;
}

// Reads a meter by SCPI-99 over a socket. It first sends CONFigure, NPLCycles and, if channels are
// stated, a scan list. Then it sends READ? repeatedly.
class ScpiSource final : public Source {
 public:
  explicit ScpiSource(const SourceAddress& address)
      : name_(address.text), link_(open_tcp_client(address, "5025")), clock_(address) {
    const std::vector<std::string> list = address.names("channels");
    std::vector<std::string> names = address.names("names");
    if (names.empty()) {
      for (const std::string& channel : list) {
        names.push_back("c" + channel);
      }
    }
    names = names.empty() ? std::vector<std::string>{"c1"} : names;
    if (!list.empty() && names.size() != list.size()) {
      address.fail(formatted("names= must have as many entries as channels= ({})", list.size()));
    }
    const std::vector<double> resistors = resistors_of(address, names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
      channels_.push_back(channel_of(names[i]));
      factors_.push_back(resistors[i] > 0.0 ? 1.0 / resistors[i] : 1.0);
      if (channels_.back().unit.empty()) {
        channels_.back().unit = resistors[i] > 0.0 ? "A" : "V";
      }
    }
    const std::string scan = list.empty() ? "" : formatted("(@{})", joined(list, ","));
    const std::string range =
        address.find("range") ? number_text(address.number_or("range", 10.0, 1e-9, 1e9)) : "DEF";
    commands_ = {"*CLS", formatted("CONF:VOLT:DC {}{}", range, scan.empty() ? "" : "," + scan)};
    if (address.find("nplc")) {
      commands_.push_back(formatted("VOLT:DC:NPLC {}{}",
                                    number_text(address.number_or("nplc", 1.0, 1e-4, 1e3)),
                                    scan.empty() ? "" : "," + scan));
    }
    if (!scan.empty()) {
      commands_.push_back("ROUT:SCAN " + scan);
    }
    if (const auto more = address.find("setup")) {
      for (const std::string_view one : split(*more, ';')) {
        commands_.emplace_back(one);
      }
    }
    query_ = address.text_or("read", "READ?");
  }

  [[nodiscard]] const std::vector<Channel>& channels() const override { return channels_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] double stated_rate_hz() const override { return clock_.rate_hz(); }

  SourceReport read(SampleBatch& batch, std::chrono::milliseconds patience) override {
    SourceReport report;
    const std::size_t before = held_.size();
    const LinkReport link = link_->read(held_, patience);
    report.state = link.state;
    report.message = link.message;
    report.bytes = held_.size() - before;
    if (link.state != LinkState::open) {
      step_ = Step::connect;
      held_.clear();
      return report;
    }
    if (step_ == Step::connect) {
      begin();
    }
    take_replies(batch, report);
    if (step_ != Step::connect && session_seconds() - asked_s_ > longest_answer_s) {
      report.message = formatted(
          "{}: the instrument has not answered the command {} for {} s; the set-up commands are "
          "sent again",
          name_, asked_, number_text(longest_answer_s));
      begin();
    }
    if (!complaint_.empty()) {
      report.message = complaint_;
    }
    return report;
  }

 private:
  enum class Step { connect, errors, readings };

  void begin() {
    std::string text;
    for (const std::string& command : commands_) {
      text += command + "\n";
    }
    complaint_.clear();
    held_.clear();
    errors_ = 0;
    if (link_->write(text)) {
      step_ = Step::errors;
      ask("SYST:ERR?");
    }
  }

  void ask(const std::string& query) {
    asked_ = query;
    asked_s_ = session_seconds();
    link_->write(query + "\n");
  }

  void take_replies(SampleBatch& batch, SourceReport& report) {
    for (std::size_t end = held_.find('\n'); end != std::string::npos; end = held_.find('\n')) {
      const std::string reply(trimmed(std::string_view(held_).substr(0, end)));
      held_.erase(0, end + 1);
      if (step_ == Step::errors) {
        // Replies are errors such as -222,"Data out of range"; +0,"No error" is the last reply.
        if (parse_number(split(reply, ',').front()).value_or(-1.0) != 0.0) {
          complaint_ = formatted("{}: the meter rejects the set-up commands: {}", name_, reply);
          ask("SYST:ERR?");
          if (++errors_ < 20) {
            continue;
          }
        }
        step_ = Step::readings;
      } else {
        sample(reply, batch, report);
      }
      ask(query_);
    }
    if (held_.size() > longest_reply) {
      held_.clear();
      ++report.defects;
    }
  }

  void sample(const std::string& reply, SampleBatch& batch, SourceReport& report) {
    std::vector<double> values;
    for (const std::string_view cell : cells_of(reply, ',')) {
      const double value = cell_number(cell, false);
      const double factor = values.size() < factors_.size() ? factors_[values.size()] : 1.0;
      values.push_back(std::abs(value) >= overload ? std::copysign(HUGE_VAL, value)
                                                   : factor * value);
    }
    if (values.size() != channels_.size() ||
        std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) {
      ++report.defects;
      return;
    }
    clock_.append(values, session_seconds(), batch, report);
  }

  std::string name_;
  std::unique_ptr<ByteLink> link_;
  SampleClock clock_;
  std::vector<double> factors_;  // for each channel: 1 / shunt resistance, or 1 without a shunt
  std::vector<Channel> channels_;
  std::vector<std::string> commands_;
  std::string query_;
  Step step_ = Step::connect;
  std::string held_;
  std::string asked_;
  double asked_s_ = 0.0;
  std::string complaint_;
  int errors_ = 0;
};

}  // namespace

std::unique_ptr<Source> open_scpi_source(const SourceAddress& address) {
  return std::make_unique<ScpiSource>(address);
}

}  // namespace axiscal
