// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/segment.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <set>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/logs/settings.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr std::size_t block_rows = 4096;

std::string counted(std::size_t count, const char* one, const char* many) {
  return formatted("{} {}", count, count == 1 ? one : many);
}

// Converts times to seconds, and finds gaps and backward jumps in them.
class Clock {
 public:
  Clock(const std::string& path, const SegmentOptions& options)
      : path_(path), rate_hz_(options.rate_hz.value_or(0.0)), window_s_(options.window_s) {}

  // Determines the usual time step from the first block.
  // @param seconds  seconds per unit of `times`.
  void learn(const std::vector<double>& times, double seconds) {
    seconds_ = seconds;
    if (rate_hz_ > 0.0) {
      step_ = 1.0 / rate_hz_;
      return;
    }
    step_ = usual_step(times) * seconds_;
    if (!(step_ > 0.0)) {
      throw DataError(path_, "the times never increase; give the rate instead of a time column",
                      {settings::rate, settings::time_column});
    }
    longest_step_ = std::max(5.0 * step_, 0.25 * window_s_);
  }

  [[nodiscard]] double rate_hz() const { return 1.0 / step_; }

  // Computes the times of a block in seconds. Marks a sample in `broken` if its time is missing, or
  // if there is a gap or a backward jump before it.
  void run(const std::vector<double>* column,
           std::size_t count,
           std::vector<double>& time_s,
           std::vector<char>& broken) {
    time_s.resize(count);
    for (std::size_t i = 0; i < count; ++i, ++samples_) {
      if (column == nullptr) {
        time_s[i] = static_cast<double>(samples_) * step_;
        continue;
      }
      const double t = (*column)[i] * seconds_;
      if (!std::isfinite(t)) {
        time_s[i] = last_ + step_;
        broken[i] = 1;
      } else {
        time_s[i] = t;
        const double step = t - last_;
        if (samples_ > 0 && step <= 0.0) {
          ++(step < 0.0 ? decreasing : repeated);
          // A repeated time is due to a coarse clock. A decreasing time means that another
          // recording begins.
          broken[i] = step < 0.0 ? 1 : broken[i];
        } else if (samples_ > 0 && step > longest_step_ && !went_back_) {
          ++gaps;
          broken[i] = 1;
        }
      }
      went_back_ = time_s[i] < last_;
      last_ = time_s[i];
    }
  }

  std::size_t gaps = 0;
  std::size_t repeated = 0;
  std::size_t decreasing = 0;

 private:
  const std::string& path_;
  double rate_hz_;
  double seconds_ = 1.0;
  double window_s_;
  double step_ = 0.0;
  double longest_step_ = 0.0;  // a longer step is a gap
  double last_ = 0.0;
  bool went_back_ = false;  // true if the last step was negative; the next step is then not a gap
  std::size_t samples_ = 0;
};

// Replaces missing numbers by the last value of the column, so that sums stay finite. A missing
// number ends the current period of rest only if it is in a column that is used to detect rest. In
// other columns, such as those of a slower sensor, numbers may be missing.
class Repair {
 public:
  Repair(const SegmentOptions& options,
         const std::vector<std::size_t>& detection,
         std::size_t columns)
      : options_(options), detects_(columns, 0), last_(columns, 0.0), found_(columns, 0) {
    for (const std::size_t c : detection) {
      detects_[c] = 1;
    }
  }

  void run(LogBlock& samples, std::vector<char>& broken) {
    for (std::size_t c = 0; c < samples.size(); ++c) {
      for (std::size_t i = 0; i < samples[c].size(); ++i) {
        double& value = samples[c][i];
        if (!std::isfinite(value)) {
          value = last_[c];
          if (detects_[c] != 0) {
            missing += broken[i] == 0 ? 1U : 0U;
            broken[i] = 1;
          }
          continue;
        }
        found_[c] = 1;
        if (detects_[c] != 0 && options_.range &&
            (value <= options_.range->low || value >= options_.range->high)) {
          saturated += broken[i] == 0 ? 1U : 0U;
          broken[i] = 1;
        }
        last_[c] = value;
      }
    }
  }

  // @return true if a number was found in a column; otherwise the column contains text.
  [[nodiscard]] bool has_numbers(std::size_t column) const { return found_[column] != 0; }

  std::size_t missing = 0;
  std::size_t saturated = 0;

 private:
  const SegmentOptions& options_;
  std::vector<char> detects_;
  std::vector<double> last_;
  std::vector<char> found_;
};

std::vector<std::string> marks_of(const StaticInterval& interval,
                                  const std::vector<std::size_t>& detection) {
  std::vector<std::string> marks;
  const auto any = [&](const auto& is_so) {
    return std::any_of(detection.begin(), detection.end(),
                       [&](std::size_t c) { return is_so(static_cast<Eigen::Index>(c)); });
  };
  // A drift is marked if it is larger than five standard errors and larger than the noise.
  if (any([&](Eigen::Index c) {
        const double variance =
            interval.sd(c) * interval.sd(c) - interval.drift(c) * interval.drift(c) / 12.0;
        const double noise = std::sqrt(std::max(0.0, variance));
        const double se = noise * std::sqrt(12.0 / interval.effective_samples(c));
        return std::abs(interval.drift(c)) > std::max(5.0 * se, noise);
      })) {
    marks.emplace_back("drift");
  }
  if (interval.loudest > 4.0) {
    marks.emplace_back("knock");
  }
  if (any([&](Eigen::Index c) { return interval.sd(c) == 0.0; })) {
    marks.emplace_back("stuck");
  }
  const auto n = static_cast<double>(interval.samples());
  if (any([&](Eigen::Index c) { return interval.effective_samples(c) < 0.02 * n; })) {
    marks.emplace_back("restless");
  }
  return marks;
}

void warn_of_defects(const LogFile& log,
                     const Clock& clock,
                     const Repair& repair,
                     Segmentation& result) {
  const LogDefects& defects = log.defects();
  const auto warn = [&](std::size_t count, const std::string& text) {
    if (count > 0) {
      result.warnings.push_back(text);
    }
  };
  warn(defects.ragged_rows,
       formatted("{} left out because of a wrong number of cells; the first is line {}",
                 counted(defects.ragged_rows, "row was", "rows were"), defects.first_ragged_line));
  warn(repair.missing,
       formatted("{} a cell that is not a number; each such sample ends a rest{}",
                 counted(repair.missing, "sample has", "samples have"),
                 defects.first_missing_line > 0
                     ? formatted("; the first is in line {}", defects.first_missing_line)
                     : ""));
  warn(repair.saturated,
       counted(repair.saturated, "sample is", "samples are") + " at or beyond the range");
  warn(clock.gaps, counted(clock.gaps, "gap", "gaps") + " in the times: samples are missing there");
  warn(clock.decreasing, counted(clock.decreasing, "time stamp is", "time stamps are") +
                             " earlier than the one before: were several recordings joined?");
  if (result.rate_hz < 1.0) {
    result.warnings.push_back(
        formatted("the rate is {} Hz: are the times in milliseconds or microseconds? Then name the "
                  "column t_ms or t_us, or give the rate",
                  number_text(result.rate_hz, 3)));
  }
  if (clock.repeated > 0) {
    result.notes.push_back(counted(clock.repeated, "time stamp is", "time stamps are") +
                           " equal to the one before");
  }
}

std::string runs_text(const std::vector<std::size_t>& rests) {
  std::string text;
  for (std::size_t i = 0; i < rests.size() && i < 8; ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(rests[i]);
  }
  return rests.size() > 8 ? text + ", ..." : text;
}

void warn_of_marks(Segmentation& result) {
  const std::vector<std::pair<std::string, std::string>> meanings = {
      {"drift", "a drift larger than the noise; let the instrument come to rest and warm up"},
      {"knock", "a knock, or motion at the start or end of the rest; the means may be wrong"},
      {"stuck", "a column does not vary: it is saturated, frozen, or has a coarse resolution"},
      {"restless", "a slow change that is not noise: was the instrument at rest?"}};
  for (const auto& [mark, meaning] : meanings) {
    std::vector<std::size_t> rests;
    for (std::size_t i = 0; i < result.marks.size(); ++i) {
      if (std::find(result.marks[i].begin(), result.marks[i].end(), mark) !=
          result.marks[i].end()) {
        rests.push_back(i + 1);
      }
    }
    if (!rests.empty()) {
      result.warnings.push_back(
          formatted("{}{}: {}", rests.size() == 1 ? "rest " : "rests ", runs_text(rests), meaning));
    }
  }
}

// @return the largest difference between the means of two rests in one of the columns.
double largest_spread(const std::vector<StaticInterval>& intervals,
                      const std::vector<std::size_t>& columns) {
  double largest = 0.0;
  for (const std::size_t column : columns) {
    const auto [low, high] = std::minmax_element(
        intervals.begin(), intervals.end(), [&](const StaticInterval& a, const StaticInterval& b) {
          const auto c = static_cast<Eigen::Index>(column);
          return a.mean(c) < b.mean(c);
        });
    const auto c = static_cast<Eigen::Index>(column);
    largest = std::max(largest, high->mean(c) - low->mean(c));
  }
  return largest;
}

// The columns that are selected from a log. All other columns come before the column of times.
struct SelectedColumns {
  TimeColumn times;
  bool has_times = false;
  std::vector<std::size_t> attitude;  // columns whose means distinguish attitudes
};

SelectedColumns select_columns(LogFile& log, const SegmentOptions& options, Segmentation& result) {
  const std::optional<TimeColumn> found =
      find_time_column(log.path(), log.columns(), options.rate_hz ? "" : options.time);
  if (!found && !options.rate_hz) {
    throw DataError(
        log.path(),
        formatted("contains no column of times; its columns are {}; name the column of times, or "
                  "give the rate",
                  joined(log.columns())),
        {settings::time_column, settings::rate});
  }
  SelectedColumns chosen;
  chosen.times = found.value_or(TimeColumn{.position = log.columns().size()});
  chosen.has_times = found && !options.rate_hz;  // a rate replaces the column of times
  std::vector<std::size_t> selected;
  for (std::size_t c = 0; c < log.columns().size(); ++c) {
    if (c != chosen.times.position) {
      selected.push_back(c);
      result.columns.push_back(log.columns()[c]);
    }
  }
  const auto positions_of = [&](const std::vector<std::string>& names) {
    std::vector<std::size_t> positions;
    for (const std::string& name : names) {
      static_cast<void>(log.need(name));
      positions.push_back(*find_column(result.columns, name));
    }
    return positions;
  };
  for (const std::string& name : options.columns) {
    if (found && log.need(name) == chosen.times.position) {
      throw DataError(log.path(),
                      formatted("column '{}' is the column of times, so it cannot be the column "
                                "of a sensor",
                                name));
    }
  }
  result.detection = positions_of(options.columns);
  chosen.attitude = options.attitude.empty() ? result.detection : positions_of(options.attitude);
  if (chosen.has_times) {
    selected.push_back(chosen.times.position);
  }
  log.select(selected);
  return chosen;
}

DetectorOptions detector_options(const SegmentOptions& options,
                                 const std::vector<std::size_t>& detection,
                                 double rate_hz) {
  const auto in_samples = [&](double seconds) {
    return static_cast<std::size_t>(std::lround(std::max(0.0, seconds) * rate_hz));
  };
  return {.detection = detection,
          .window = std::max<std::size_t>(in_samples(options.window_s), 3),
          .trim = in_samples(options.trim_s),
          .shortest = std::max<std::size_t>(in_samples(options.shortest_s), 2),
          .threshold = options.threshold};
}

// Keeps only the longer part of each rest that was split by a knock.
void join_rests(const SegmentOptions& options,
                const std::vector<std::size_t>& attitude,
                Segmentation& result) {
  const double size = largest_spread(result.intervals, attitude);
  const std::size_t joined_rests = join_split_rests(
      result.intervals, attitude, options.window_s + 2.0 * options.trim_s + 0.5, 2e-3 * size);
  if (joined_rests > 0) {
    result.notes.push_back(counted(joined_rests, "rest was", "rests were") +
                           " split by a knock, and only the longer part is used");
  }
}

// Reads the blocks of a log in advance: a thread reads the next blocks while the current ones are
// processed.
class BlocksAhead {
 public:
  // The first block is read on its own and without a thread, because the log may be short.
  explicit BlocksAhead(LogFile& log) : log_(log) { read(1, false); }

  // @return the number of rows; 0 at the end.
  std::size_t next(LogBlock& block) {
    if (used_ == blocks_.size()) {
      blocks_ = reading_.get();
      used_ = 0;
      // A thread is used only if the last batch was complete. The first batch is a single block,
      // and a later batch with fewer blocks is the last one.
      read(batch, blocks_.size() == batch);
    }
    if (blocks_.empty()) {
      return 0;
    }
    Block& one = blocks_[used_++];
    block = std::move(one.columns);
    return one.rows;
  }

 private:
  struct Block {
    LogBlock columns;
    std::size_t rows = 0;
  };
  static constexpr std::size_t batch = 8;

  void read(std::size_t count, bool ahead) {
    const auto work = [this, count] {
      std::vector<Block> blocks;
      while (blocks.size() < count) {
        Block one;
        one.rows = log_.read(one.columns, block_rows);
        if (one.rows == 0) {
          break;
        }
        blocks.push_back(std::move(one));
      }
      return blocks;
    };
    reading_ = begin_work(work, ahead);
  }

  LogFile& log_;
  std::vector<Block> blocks_;
  std::size_t used_ = 0;
  std::future<std::vector<Block>> reading_;  // its destructor waits for the thread
};

// Marks as broken the samples in `options.left_out`, and the first sample of each recording in
// `options.begins`.
// @param first  index in the log of the first sample of the block.
void break_samples(const SegmentOptions& options, std::size_t first, std::vector<char>& broken) {
  const std::size_t end = first + broken.size();
  for (const auto& [from, to] : options.left_out) {
    for (std::size_t i = std::max(from, first); i < std::min(to, end); ++i) {
      broken[i - first] = 1;
    }
  }
  for (const std::size_t begin : options.begins) {
    if (begin >= first && begin < end) {
      broken[begin - first] = 1;
    }
  }
}

// Adds a note for each column without numbers, and sets the means of the column to NaN.
void blank_empty_columns(const Repair& repair, Segmentation& result) {
  for (std::size_t c = 0; c < result.columns.size(); ++c) {
    if (!repair.has_numbers(c)) {
      result.notes.push_back(formatted("column '{}' contains no numbers", result.columns[c]));
      for (StaticInterval& interval : result.intervals) {
        interval.mean(static_cast<Eigen::Index>(c)) = not_a_number;
      }
    }
  }
}

}  // namespace

Segmentation segment(LogFile& log, const SegmentOptions& options, const ThresholdChoice& choose) {
  Segmentation result;
  const SelectedColumns selected = select_columns(log, options, result);
  Clock clock(log.path(), options);
  Repair repair(options, result.detection, result.columns.size());
  std::optional<StaticDetector> detector;
  BlocksAhead blocks(log);
  LogBlock block;
  std::vector<double> time_s;
  std::vector<char> broken;
  while (const std::size_t count = blocks.next(block)) {
    std::vector<double> times;
    if (selected.has_times) {
      times = std::move(block.back());
      block.pop_back();
    }
    if (!detector) {
      TimeUnit unit;
      if (selected.has_times) {
        unit = settle_time_unit(log.path(), selected.times, times);
      }
      if (!unit.remark.empty()) {
        result.warnings.push_back(unit.remark);
      }
      clock.learn(times, unit.seconds);
      detector.emplace(detector_options(options, result.detection, clock.rate_hz()),
                       result.columns.size());
    }
    broken.assign(count, 0);
    clock.run(selected.has_times ? &times : nullptr, count, time_s, broken);
    break_samples(options, result.samples, broken);
    repair.run(block, broken);
    result.broken_samples +=
        static_cast<std::size_t>(std::count(broken.begin(), broken.end(), char{1}));
    detector->add(time_s, block, broken);
    result.samples += count;
  }
  if (!detector) {
    throw DataError(log.path(), "contains no samples");
  }
  result.rate_hz = clock.rate_hz();
  result.notes = log.notes();
  std::vector<IntervalSet> sets = detector->finish();
  for (const IntervalSet& set : sets) {
    if (std::isfinite(set.threshold)) {
      result.tried.emplace_back(set.threshold, set.intervals.size());
    }
  }
  const std::size_t chosen =
      choose && sets.size() > 1 ? choose(sets, result) : most_persistent(sets);
  result.threshold = sets[chosen].threshold;
  result.intervals = std::move(sets[chosen].intervals);
  warn_of_defects(log, clock, repair, result);
  if (result.intervals.empty()) {
    throw RefusedError(
        formatted("no rest of {} s or more was found in {} ({} s): let the instrument stand still "
                  "longer in each position, or allow shorter rests",
                  number_text(options.shortest_s, 3), counted(result.samples, "sample", "samples"),
                  number_text(static_cast<double>(result.samples) / result.rate_hz, 4)),
        {settings::shortest_rest});
  }
  if (options.join) {
    join_rests(options, selected.attitude, result);
  }
  blank_empty_columns(repair, result);
  for (const StaticInterval& interval : result.intervals) {
    result.marks.push_back(marks_of(interval, result.detection));
  }
  warn_of_marks(result);
  return result;
}

namespace {

// @return the names of those parts of an induced field for which a sheet states separate levels.
std::set<std::string> parts_with_levels(const std::vector<RunSheetRow>& sheet) {
  std::set<std::string> parts;
  for (const RunSheetRow& row : sheet) {
    for (const auto& [name, level] : row.entry.level.of_parts()) {
      parts.insert(name);
    }
  }
  return parts;
}

}  // namespace

std::string segmentation_csv(const Segmentation& segmentation,
                             const SeatLabels* labels,
                             const std::vector<RunSheetRow>& sheet) {
  const bool has_level = std::any_of(sheet.begin(), sheet.end(), [](const RunSheetRow& row) {
    return row.entry.level.of_all() != 1.0;
  });
  std::string text = "run,";
  text += labels != nullptr && !sheet.empty() ? "block,rest,fence,"
          : labels != nullptr                 ? "rest,fence,"
                                              : "";
  text += has_level ? "level," : "";
  const std::set<std::string> parts = parts_with_levels(sheet);
  for (const std::string& part : parts) {
    text += formatted("level.{},", part);
  }
  text += "start,end,samples";
  for (const std::string& column : segmentation.columns) {
    text += "," + formula_safe_cell(column);
  }
  for (const std::size_t c : segmentation.detection) {
    text += "," + formula_safe_cell(segmentation.columns[c] + "_sd");
  }
  text += ",effective_samples,marks\n";
  int run = 0;
  for (std::size_t i = 0; i < segmentation.intervals.size(); ++i) {
    const StaticInterval& interval = segmentation.intervals[i];
    ++run;
    if (labels != nullptr && !labels->points[i]) {
      continue;
    }
    const RunSheetRow* row = nullptr;
    if (labels != nullptr && !labels->rows.empty() && labels->rows[i]) {
      row = &sheet[*labels->rows[i]];
    }
    text += formatted("{},", row != nullptr ? row->run : run);
    if (row != nullptr) {
      text += formatted("{},", row->block);
    }
    if (labels != nullptr) {
      text += formatted("{},{},", face_name(labels->points[i]->rest()),
                        face_name(labels->points[i]->fence()));
    }
    if (has_level) {
      text += (row != nullptr ? number_text(row->entry.level.of_all()) : "1") + ",";
    }
    for (const std::string& part : parts) {
      text += (row != nullptr ? number_text(row->entry.level.of(part)) : "1") + ",";
    }
    text += formatted("{},{},{}", number_text(interval.start_s), number_text(interval.end_s),
                      interval.samples());
    for (const double mean : interval.mean) {
      text += "," + (std::isfinite(mean) ? number_text(mean) : "");
    }
    double effective = static_cast<double>(interval.samples());
    for (const std::size_t c : segmentation.detection) {
      text += "," + number_text(interval.sd(static_cast<Eigen::Index>(c)));
      effective = std::min(effective, interval.effective_samples(static_cast<Eigen::Index>(c)));
    }
    text += formatted(",{},", number_text(effective, 4));
    for (const std::string& mark : segmentation.marks[i]) {
      text += (text.back() == ',' ? "" : " ") + mark;
    }
    text += "\n";
  }
  return text;
}

namespace {

// @return a matrix of numbers, with a row for each rest and a column for each name in `columns`.
// @param number  function that returns the number for a rest and the index of a column.
template <typename Number>
Eigen::MatrixXd by_rests(const Segmentation& segmentation,
                         const std::vector<std::string>& columns,
                         const Number& number) {
  Eigen::MatrixXd numbers(static_cast<Eigen::Index>(segmentation.intervals.size()),
                          static_cast<Eigen::Index>(columns.size()));
  for (std::size_t j = 0; j < columns.size(); ++j) {
    const auto column =
        static_cast<Eigen::Index>(find_column(segmentation.columns, columns[j]).value());
    for (std::size_t i = 0; i < segmentation.intervals.size(); ++i) {
      numbers(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          number(segmentation.intervals[i], column);
    }
  }
  return numbers;
}

}  // namespace

Eigen::MatrixXd means_of(const Segmentation& segmentation,
                         const std::vector<std::string>& columns) {
  return by_rests(segmentation, columns, [](const StaticInterval& rest, Eigen::Index column) {
    return rest.mean(column);
  });
}

Eigen::MatrixXd mean_uncertainties_of(const Segmentation& segmentation,
                                      const std::vector<std::string>& columns) {
  return by_rests(segmentation, columns, [](const StaticInterval& rest, Eigen::Index column) {
    return rest.sd(column) / std::sqrt(rest.effective_samples(column));
  });
}

}  // namespace axiscal
