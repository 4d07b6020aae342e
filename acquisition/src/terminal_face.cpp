// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <chrono>
#include <clocale>
#include <cmath>
#include <deque>
#include <numbers>
#include <numeric>
#include <thread>

#include "axiscal/acquisition/session_face.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/positioner/facing.hpp"

#ifdef AXISCAL_NCURSES
#define NCURSES_NOMACROS 1  // disables macros such as erase() and move()
#include <ncurses.h>

#include "axiscal/acquisition/settings.hpp"
#include "core/formatted.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_NCURSES
namespace {

constexpr int fewest_lines = 24;
constexpr int fewest_columns = 80;
constexpr std::size_t lines_of_log = 4;

struct KeyBinding {
  int key;
  SessionAction action;
  const char* words;
};
constexpr std::array bindings = {
    KeyBinding{' ', SessionAction::capture, "space take reading"},
    KeyBinding{'a', SessionAction::accept, "a accept reading"},
    KeyBinding{'l', SessionAction::as_seen, "l accept recognised pose"},
    KeyBinding{'t', SessionAction::retake_suggested, "t retake suspects"},
    KeyBinding{'u', SessionAction::undo, "u undo"},
    KeyBinding{'r', SessionAction::retake, "r retake last"},
    KeyBinding{'s', SessionAction::skip, "s skip"},
    KeyBinding{'p', SessionAction::pause, "p pause"},
    KeyBinding{'g', SessionAction::go_on, "g go on"},
    KeyBinding{'m', SessionAction::toggle_automatic, "m automatic"},
    KeyBinding{'n', SessionAction::replicate, "n repeat all points"},
    KeyBinding{'f', SessionAction::finish, "f finish"},
    KeyBinding{'q', SessionAction::quit, "q stop"},
};

enum Pair : short { plain = 0, good = 1, warn = 2, bad = 3, rest = 4, fence = 5 };

std::string bar(double part, int width) {
  const int full = static_cast<int>(std::lround(std::clamp(part, 0.0, 1.0) * width));
  return formatted("[{}{}]", std::string(static_cast<std::size_t>(full), '#'),
                   std::string(static_cast<std::size_t>(width - full), '.'));
}

class TerminalFace final : public SessionFace {
 public:
  explicit TerminalFace(std::string title) : title_(std::move(title)) {
    std::setlocale(LC_CTYPE, "");
    screen_ = ::newterm(nullptr, stdout, stdin);
    if (screen_ == nullptr) {
      throw DomainError(
          "this terminal (TERM) does not support a full screen; use plain lines of "
          "text",
          {settings::plain_face});
    }
    ::set_term(screen_);
    ::raw();
    ::noecho();
    ::curs_set(0);
    ::keypad(stdscr, TRUE);
    ::nodelay(stdscr, TRUE);
    if (::has_colors()) {
      ::start_color();
      ::use_default_colors();
      ::init_pair(good, COLOR_GREEN, -1);
      ::init_pair(warn, COLOR_YELLOW, -1);
      ::init_pair(bad, COLOR_RED, -1);
      ::init_pair(rest, COLOR_CYAN, -1);
      ::init_pair(fence, COLOR_YELLOW, -1);
    }
  }

  ~TerminalFace() override {
    ::endwin();
    ::delscreen(screen_);
  }

  void show(const SessionView& view, const std::vector<SessionEvent>& events) override {
    for (const SessionEvent& event : events) {
      log_.push_back(event);
      if (log_.size() > lines_of_log) {
        log_.pop_front();
      }
      if (event.kind == "question" || event.kind == "alarm") {
        ::flash();
      } else if (event.kind == "captured") {
        ::beep();
      }
    }
    actions_ = possible_actions(view);
    ::erase();
    if (LINES < fewest_lines || COLS < fewest_columns) {
      put(0, 0,
          formatted("This window is {} x {}; make it 80 x 24 or larger. The session goes on.", COLS,
                    LINES));
      ::refresh();
      return;
    }
    draw(view);
    ::refresh();
  }

  // Displays the result until a key is pressed.
  bool conclude(const SessionView& view, const std::vector<SessionFile>& files) override {
    for (;;) {
      ::erase();
      draw_outcome(view, files);
      ::refresh();
      const int key = ::getch();
      if (key == 'n') {
        return true;
      }
      constexpr int control_c = 3;
      if (key == 'q' || key == '\n' || key == KEY_ENTER || key == ' ' || key == control_c) {
        return false;
      }
      constexpr std::chrono::milliseconds patience{50};
      std::this_thread::sleep_for(patience);
    }
  }

  std::vector<SessionCommand> commands() override {
    std::vector<SessionCommand> result;
    for (int key = ::getch(); key != ERR; key = ::getch()) {
      constexpr int control_c = 3;
      key = key == control_c ? 'q' : key == '\n' || key == KEY_ENTER ? ' ' : key;
      for (const KeyBinding& binding : bindings) {
        if (binding.key != key ||
            std::find(actions_.begin(), actions_.end(), binding.action) == actions_.end()) {
          continue;
        }
        if (binding.action == SessionAction::quit && !std::exchange(asked_to_quit_, true)) {
          note("press q once more to stop; the session can be resumed");
          break;
        }
        result.push_back({.action = binding.action, .run = {}});
      }
      asked_to_quit_ = asked_to_quit_ && key == 'q';
    }
    return result;
  }

 private:
  void note(const std::string& text) {
    log_.push_back({.kind = "note", .text = text, .time_s = 0.0, .run = {}, .point = {}});
    if (log_.size() > lines_of_log) {
      log_.pop_front();
    }
  }

  static void put(int line, int column, const std::string& text, int style = 0) {
    if (column >= COLS) {
      return;
    }
    ::attron(style);
    ::mvaddnstr(line, column, text.c_str(), static_cast<int>(bytes_of(text, COLS - column)));
    ::attroff(style);
  }

  // Returns the number of bytes in the first `characters` characters of a UTF-8 text.
  static std::size_t bytes_of(const std::string& text, int characters) {
    std::size_t bytes = 0;
    for (; bytes < text.size(); ++bytes) {
      const bool begins = (static_cast<unsigned char>(text[bytes]) & 0xC0U) != 0x80U;
      if (begins && characters-- == 0) {
        break;
      }
    }
    return bytes;
  }

  static int width_of(const std::string& text) {
    return static_cast<int>(std::count_if(text.begin(), text.end(), [](char c) {
      return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
    }));
  }

  // Draws a table with each column as wide as its widest cell. If the row is wider than the screen,
  // the uncertainties are drawn on the next line.
  static int put_table(int line, std::vector<std::vector<std::string>> rows) {
    const auto widths_of = [](const std::vector<std::vector<std::string>>& all) {
      std::vector<int> widths;
      for (const std::vector<std::string>& row : all) {
        widths.resize(std::max(widths.size(), row.size()));
        for (std::size_t i = 0; i < row.size(); ++i) {
          widths[i] = std::max(widths[i], width_of(row[i]) + 2);
        }
      }
      return widths;
    };
    std::vector<int> widths = widths_of(rows);
    if (std::accumulate(widths.begin(), widths.end(), 0) > COLS - 1) {
      std::vector<std::vector<std::string>> parted;
      const std::string sign = " \u00b1";
      for (const std::vector<std::string>& row : rows) {
        std::vector<std::string> values;
        std::vector<std::string> uncertainties;
        for (const std::string& cell : row) {
          const std::size_t at = cell.find(sign);
          values.push_back(cell.substr(0, at));
          uncertainties.push_back(at == std::string::npos ? "" : cell.substr(at + 1));
        }
        parted.push_back(values);
        if (std::any_of(uncertainties.begin(), uncertainties.end(),
                        [](const std::string& one) { return !one.empty(); })) {
          parted.push_back(uncertainties);
        }
      }
      rows = std::move(parted);
      widths = widths_of(rows);
    }
    for (const std::vector<std::string>& row : rows) {
      int column = 1;
      for (std::size_t i = 0; i < row.size(); ++i) {
        put(line, column, row[i]);
        column += widths[i];
      }
      ++line;
    }
    return line;
  }

  // Draws a text in at most `most` lines, broken at blanks. Returns the number of the next line.
  static int put_wrapped(int line, int most, const std::string& text, int style = 0) {
    std::string left = text;
    const auto width = static_cast<std::size_t>(COLS - 2);
    for (int i = 0; i < most && !left.empty(); ++i, ++line) {
      std::size_t end = left.size();
      if (end > width) {
        end = left.rfind(' ', width);
        end = end == std::string::npos ? width : end;
      }
      put(line, 1, left.substr(0, end), style);
      left.erase(0, end + (end < left.size() ? 1 : 0));
    }
    return line;
  }

  void draw(const SessionView& view) {
    const bool is_bad = view.phase == SessionPhase::question || view.phase == SessionPhase::storing;
    const int head = static_cast<int>(A_BOLD) |
                     static_cast<int>(is_bad                                 ? COLOR_PAIR(bad)
                                      : view.phase == SessionPhase::dwelling ? COLOR_PAIR(warn)
                                      : view.phase == SessionPhase::over     ? COLOR_PAIR(good)
                                                                             : COLOR_PAIR(plain));
    put(0, 1, title_, static_cast<int>(A_REVERSE));
    const std::string count = view.free ? formatted("{} readings", view.done)
                                        : formatted("{} done, {} to go", view.done, view.left);
    put(0, COLS - static_cast<int>(count.size()) - 1, count);
    put_wrapped(2, 2, view.headline, head);
    put_wrapped(4, 2, view.detail);
    if (view.free && view.phase != SessionPhase::over) {
      draw_sphere(*view.free);
    } else {
      draw_cube(view);
      draw_gauges(view);
      draw_steps(view);
    }
    int line = 18;
    for (const SessionAlarm& alarm : view.alarms) {
      if (line < 20) {
        put(line++, 1, "! " + alarm.text,
            static_cast<int>(A_BOLD) | static_cast<int>(COLOR_PAIR(bad)));
      }
    }
    for (auto event = log_.rbegin(); event != log_.rend() && line < LINES - 2; ++event) {
      put(line++, 1, event->text);
    }
    draw_keys();
  }

  // Draws the verdict and the coefficients of each slot.
  static int draw_results(int line, const SessionView& view) {
    for (const SessionOutcome& outcome : view.outcomes) {
      const int style = static_cast<int>(COLOR_PAIR(outcome.status == "ok"        ? good
                                                    : outcome.status == "warning" ? warn
                                                                                  : bad));
      put(line++, 1, (outcome.slot.empty() ? "" : "slot " + outcome.slot + ": ") + outcome.verdict,
          static_cast<int>(A_BOLD) | style);
      std::vector<std::vector<std::string>> rows = outcome.rows;
      rows.insert(rows.begin(), outcome.head);
      line = put_table(line, std::move(rows));
    }
    return line;
  }

  void draw_outcome(const SessionView& view, const std::vector<SessionFile>& files) const {
    put(0, 1, title_, static_cast<int>(A_REVERSE));
    int line = draw_results(2, view) + 1;
    for (const std::string& text : view.result) {
      if (line < LINES - 7) {
        line = put_wrapped(line, 2, text);
      }
    }
    ++line;
    for (const SessionFile& file : files) {
      if (line < LINES - 2 && !file.name.ends_with(".pdf") && !file.name.ends_with(".h")) {
        put(line++, 1, formatted("{:<12}{}", file.label, file.name));
      }
    }
    put(LINES - 1, 1, "n new session, same instrument | q leave", static_cast<int>(A_BOLD));
  }

  void draw_cube(const SessionView& view) {
    if (!view.wanted) {
      int line = draw_results(7, view) + (view.outcomes.empty() ? 0 : 1);
      for (const std::string& text : view.result) {
        if (line < 15) {
          line = put_wrapped(line, 2, text);
        }
      }
      return;
    }
    const DesignPoint& point = view.wanted->entry.point;
    const auto name_towards = [&](const Eigen::Vector3d& direction_in_table) {
      return std::string(face_name(face_towards(point, direction_in_table)));
    };
    const std::string above = name_towards(Eigen::Vector3d::UnitZ());
    const std::string front = name_towards(-Eigen::Vector3d::UnitY());
    const std::string right = name_towards(Eigen::Vector3d::UnitX());
    const std::string down(face_name(point.rest()));
    const std::string back(face_name(point.fence()));
    put(7, 3, "at the fence: " + back,
        static_cast<int>(A_BOLD) | static_cast<int>(COLOR_PAIR(fence)));
    put(8, 3, "========================");
    put(9, 6, "+---------+");
    put(10, 5, formatted("/   {}    /|", above));
    put(11, 4, "+---------+ |");
    put(12, 4, "|         |" + right);
    put(13, 4, formatted("|   {}    | +", front));
    put(14, 4, "|         |/");
    put(15, 4, "+---------+");
    put(16, 3, "on the table: " + down,
        static_cast<int>(A_BOLD) | static_cast<int>(COLOR_PAIR(rest)));
  }

  // Draws the sphere as an equal-area map with three kinds of marks: the readings, the current
  // direction and the requested direction.
  static void draw_sphere(const FreeView& free) {
    constexpr int columns = 36;
    constexpr int lines = 9;
    std::array<std::string, lines> map;
    map.fill(std::string(columns, '.'));
    const auto cell_of = [](const Eigen::Vector3d& v) {
      const Eigen::Vector3d u = v.normalized();
      const double around = std::atan2(u.y(), u.x()) / (2.0 * std::numbers::pi) + 0.5;
      return std::pair(std::clamp(static_cast<int>(0.5 * (1.0 - u.z()) * lines), 0, lines - 1),
                       std::clamp(static_cast<int>(around * columns), 0, columns - 1));
    };
    const auto mark = [&](const Eigen::Vector3d& v, char sign) {
      if (v.allFinite() && !v.isZero(0.0)) {
        const auto [line, column] = cell_of(v);
        map.at(static_cast<std::size_t>(line)).at(static_cast<std::size_t>(column)) = sign;
      }
    };
    for (const Eigen::Vector3d& point : free.points) {
      mark(free.to_sphere * (point - free.centre), '#');
    }
    if (!free.is_enough && !free.points.empty()) {
      mark(free.gap, '?');
    }
    mark(free.to_sphere * (free.now - free.centre), '@');
    put(7, 1, "sphere, z up: # = reading, . = gap");
    for (int line = 0; line < lines; ++line) {
      put(8 + line, 1, map.at(static_cast<std::size_t>(line)));
    }
    put(17, 1, "@ = direction now, ? = next direction");
    constexpr int column = 42;
    put(8, column, "filled   " + bar(free.coverage, 24));
    put(9, column, formatted("largest gap {:.0f} deg", free.largest_gap_rad * deg_per_rad));
    if (free.fit_error) {
      put(10, column, formatted("fit error {} %", number_text(100.0 * *free.fit_error, 2)));
    }
    put(11, column,
        free.u_deg ? formatted("uncertainty {} deg (95 %)", number_text(*free.u_deg, 2))
                   : std::string("uncertainty not yet known"));
    put(12, column, formatted("target {} deg", number_text(free.wanted_deg, 2)));
    int line = 13;
    for (const auto& [name, value] : free.numbers) {
      put(line++, column, name + ":");
      put(line++, column + 1, value);
    }
  }

  static void draw_gauges(const SessionView& view) {
    if (!view.wanted) {
      return;
    }
    constexpr int column = 34;
    constexpr int width = 24;
    const bool is_still = view.stillness <= 1.0;
    // Logarithmic scale: three decades above the limit of stillness.
    const double motion = std::log10(std::max(1.0, view.stillness)) / 3.0;
    put(7, column, std::string(is_still ? "still  " : "moving ") + bar(motion, width),
        static_cast<int>(COLOR_PAIR(is_still ? good : warn)));
    put(8, column,
        formatted("dwell  {} {} s", bar(view.progress, width), number_text(view.dwell_s, 2)));
    std::string reading;
    for (const double value : view.reading) {
      reading += number_text(value, 6) + "  ";
    }
    put(10, column, "reading  " + reading);
    put(11, column,
        formatted("rate     {} samples per second{}", number_text(view.rate_hz, 4),
                  view.automatic ? "" : "; manual"));
    if (view.temperature) {
      put(12, column, "temperature " + number_text(*view.temperature, 5));
    }
    if (view.slope) {
      put(13, column,
          formatted("slope    {}, {} mrad, +- {}", number_text(1e3 * view.slope->x(), 3),
                    number_text(1e3 * view.slope->y(), 3),
                    number_text(2e3 * view.slope_u.maxCoeff(), 2)));
    }
    if (view.forecast_deg) {
      put(14, column,
          formatted("forecast of the angle error {} deg (1 sd)",
                    number_text(*view.forecast_deg, 2)));
    }
    if (view.remaining_s) {
      put(15, column,
          formatted("about {} min to go", number_text(std::ceil(*view.remaining_s / 60.0), 3)));
    }
  }

  static void draw_steps(const SessionView& view) {
    int column = 1;
    bool next = true;
    for (const SessionStep& step : view.steps) {
      const bool suspect = step.run && std::find(view.suspects.begin(), view.suspects.end(),
                                                 *step.run) != view.suspects.end();
      const bool is_next = !step.run && !step.skipped && std::exchange(next, false);
      const char* const mark = suspect        ? "?"
                               : step.run     ? "*"
                               : step.skipped ? "-"
                               : is_next      ? ">"
                                              : ".";
      if (column < COLS - 2) {
        put(17, column, mark,
            static_cast<int>(suspect    ? COLOR_PAIR(bad)
                             : step.run ? COLOR_PAIR(good)
                                        : COLOR_PAIR(plain)));
      }
      column += 2;
    }
  }

  void draw_keys() {
    std::string keys;
    std::string more;
    for (const KeyBinding& binding : bindings) {
      if (std::find(actions_.begin(), actions_.end(), binding.action) != actions_.end()) {
        std::string& line = static_cast<int>(keys.size()) < COLS - 28 && more.empty() ? keys : more;
        line += (line.empty() ? "" : " | ") + std::string(binding.words);
      }
    }
    put(LINES - 2, 1, keys, static_cast<int>(A_BOLD));
    put(LINES - 1, 1, more, static_cast<int>(A_BOLD));
  }

  std::string title_;
  SCREEN* screen_ = nullptr;
  std::deque<SessionEvent> log_;
  std::vector<SessionAction> actions_;
  bool asked_to_quit_ = false;
};

}  // namespace

std::unique_ptr<SessionFace> make_terminal_face(const std::string& title) {
  return std::make_unique<TerminalFace>(title);
}

#else

std::unique_ptr<SessionFace> make_terminal_face(const std::string& /*title*/) {
  throw DomainError("this build lacks ncurses; use plain lines of text", {settings::plain_face});
}

#endif

}  // namespace axiscal
