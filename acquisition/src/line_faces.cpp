// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <set>

#include <poll.h>
#include <unistd.h>

#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/output_file.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

// Reads lines from standard input without blocking.
class CommandLines {
 public:
  explicit CommandLines(bool reads) : reads_(reads) {}

  [[nodiscard]] bool reads() const { return reads_; }

  [[nodiscard]] std::vector<std::string> take() {
    std::vector<std::string> lines;
    pollfd one{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    while (reads_ && ::poll(&one, 1, 0) > 0) {
      char buffer[1024];
      const ssize_t count = ::read(STDIN_FILENO, buffer, sizeof buffer);
      if (count <= 0) {
        reads_ = false;
        break;
      }
      held_.append(buffer, static_cast<std::size_t>(count));
    }
    for (std::size_t end = held_.find('\n'); end != std::string::npos; end = held_.find('\n')) {
      lines.emplace_back(trimmed(std::string_view(held_).substr(0, end)));
      held_.erase(0, end + 1);
    }
    return lines;
  }

 private:
  bool reads_;
  std::string held_;
};

class LineFace : public SessionFace {
 public:
  explicit LineFace(bool reads_commands) : lines_(reads_commands) {}

  [[nodiscard]] bool accepts_commands() const override { return lines_.reads(); }

  std::vector<SessionCommand> commands() override {
    std::vector<SessionCommand> result;
    for (const std::string& line : lines_.take()) {
      if (const std::optional<SessionCommand> command = parse_command(line)) {
        result.push_back(*command);
      } else if (!line.empty()) {
        std::fprintf(stderr, "'%s' is not a command; the commands are: %s\n", line.c_str(),
                     words_.empty() ? "none at the moment" : words_.c_str());
      }
    }
    return result;
  }

 protected:
  void remember(const SessionView& view) {
    std::vector<std::string> names;
    for (const SessionAction action : possible_actions(view)) {
      names.emplace_back(action_name(action));
    }
    words_ = joined(names);
  }

  // The commands that were possible at the last remember(), separated by commas.
  [[nodiscard]] const std::string& words() const { return words_; }

  static void print(const std::string& line) { write_whole_file("-", line + "\n"); }

 private:
  CommandLines lines_;
  std::string words_;
};

class PlainFace final : public LineFace {
 public:
  using LineFace::LineFace;

  void show(const SessionView& view, const std::vector<SessionEvent>& events) override {
    remember(view);
    for (const SessionEvent& event : events) {
      if (event.kind == "ask") {
        print(formatted("point {} of {}: {}{}", view.done + 1, view.done + view.left, view.headline,
                        view.detail.empty() ? "" : "; " + view.detail));
      } else if (event.kind == "review") {
        for (const std::string& line : view.result) {
          print(line);
        }
      } else {
        print(event.text);
      }
      if (event.kind == "captured" && view.slope) {
        print(formatted(
            "  slope of the table so far: {}, {} mrad{}{}", number_text(1e3 * view.slope->x(), 3),
            number_text(1e3 * view.slope->y(), 3),
            view.forecast_deg ? formatted("; forecast of the angle error at the end of the "
                                          "session: {} degrees (standard deviation)",
                                          number_text(*view.forecast_deg, 2))
                              : "",
            view.remaining_s ? formatted("; about {} min to go",
                                         number_text(std::ceil(*view.remaining_s / 60.0), 3))
                             : ""));
      }
    }
    if (view.phase != last_ &&
        (view.phase == SessionPhase::question || view.phase == SessionPhase::review ||
         view.phase == SessionPhase::ready || view.phase == SessionPhase::soaking)) {
      print("  commands: " + words());
    }
    if (view.free && view.phase == SessionPhase::laying) {
      tell_sphere(view);
    }
    // Prints each alarm once when it begins. An alarm that has ended may begin again.
    std::set<std::string> there;
    for (const SessionAlarm& alarm : view.alarms) {
      there.insert(alarm.code);
      if (!shown_alarms_.contains(alarm.code)) {
        print("! " + alarm.text);
      }
    }
    shown_alarms_ = std::move(there);
    last_ = view.phase;
  }

 private:
  // Prints the progress of a FreeSession if the headline has changed, or the coverage has reached
  // the next tenth.
  void tell_sphere(const SessionView& view) {
    const FreeView& free = *view.free;
    const int tenths = static_cast<int>(10.0 * free.coverage);
    if (view.headline != headline_ || tenths > tenths_) {
      print(formatted(
          "{} readings, {:.0f} % of the sphere covered{}{}; {}", free.points.size(),
          100.0 * free.coverage,
          free.fit_error ? formatted(", fit error {} %", number_text(100.0 * *free.fit_error, 2))
                         : "",
          free.u_deg ? formatted(", uncertainty {} degrees, target {} degrees (95 %)",
                                 number_text(*free.u_deg, 2), number_text(free.wanted_deg, 2))
                     : "",
          view.headline));
      headline_ = view.headline;
      tenths_ = tenths;
    }
  }

  std::string headline_;
  int tenths_ = -1;
  SessionPhase last_ = SessionPhase::waiting;
  std::set<std::string> shown_alarms_;
};

class JsonFace final : public LineFace {
 public:
  using LineFace::LineFace;

  void show(const SessionView& view, const std::vector<SessionEvent>& events) override {
    remember(view);
    for (const SessionEvent& event : events) {
      print(event_json(event));
    }
    if (!events.empty()) {
      print(formatted("{{\"event\":\"view\",\"view\":{}}}", view_json(view)));
    }
    std::string alarms;
    for (const SessionAlarm& alarm : view.alarms) {
      alarms += alarm.code + " ";
    }
    if (alarms != alarms_) {
      alarms_ = alarms;
      print(formatted("{{\"event\":\"view\",\"view\":{}}}", view_json(view)));
    }
  }

 private:
  std::string alarms_;
};

}  // namespace

std::unique_ptr<SessionFace> make_plain_face(bool reads_commands) {
  return std::make_unique<PlainFace>(reads_commands);
}

std::unique_ptr<SessionFace> make_json_face(bool reads_commands) {
  return std::make_unique<JsonFace>(reads_commands);
}

}  // namespace axiscal
