// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/static_detector.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "axiscal/core/error.hpp"
#include "kernels/sliding_variance.hpp"

namespace axiscal {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

// Sums over a part of a column x with u_i = x_i - reference. The members are the sums of u_i,
// u_i^2, u_i u_(i+1) and i u_i, and the number of samples that differ from the sample before them.
struct Sums {
  double u = 0.0;
  double uu = 0.0;
  double lag = 0.0;
  double iu = 0.0;
  double changes = 0.0;
};

// Prefix sums of one column: the Sums from the start of the buffer up to each sample. The reference
// is the first value in the buffer.
class Prefix {
 public:
  void make(const std::vector<double>& x, std::size_t count) {
    reference_ = x.front();
    u_.resize(count + 1);
    uu_.resize(count + 1);
    lag_.resize(count + 1);
    iu_.resize(count + 1);
    changes_.resize(count + 1);
    Sums sums;
    double next = 0.0;  // x[i] - reference
    for (std::size_t i = 0; i < count; ++i) {
      u_[i] = sums.u;
      uu_[i] = sums.uu;
      lag_[i] = sums.lag;
      iu_[i] = sums.iu;
      changes_[i] = sums.changes;
      const double u = next;
      next = i + 1 < x.size() ? x[i + 1] - reference_ : 0.0;
      sums.u += u;
      sums.uu += u * u;
      sums.lag += u * next;
      sums.iu += static_cast<double>(i) * u;
      sums.changes += i + 1 < x.size() && x[i + 1] != x[i] ? 1.0 : 0.0;
    }
    u_[count] = sums.u;
    uu_[count] = sums.uu;
    lag_[count] = sums.lag;
    iu_[count] = sums.iu;
    changes_[count] = sums.changes;
  }

  // @return the sums over the samples begin .. end - 1, converted to another reference. In the sum
  //         of i u_i, the index i is counted from the sample `origin`.
  [[nodiscard]] Sums between(std::size_t begin,
                             std::size_t end,
                             double reference,
                             double origin) const {
    const auto n = static_cast<double>(end - begin);
    const double d = reference_ - reference;
    const double u = u_[end] - u_[begin];
    const double ordinals = 0.5 * n * (static_cast<double>(begin) + static_cast<double>(end) - 1.0);
    Sums sums{.u = u + n * d,
              .uu = uu_[end] - uu_[begin] + 2.0 * d * u + n * d * d,
              .iu = iu_[end] - iu_[begin] + d * ordinals - origin * (u + n * d)};
    if (end > begin + 1) {
      const double first_ones = u_[end - 1] - u_[begin];
      const double last_ones = u_[end] - u_[begin + 1];
      sums.lag = lag_[end - 1] - lag_[begin] + d * (first_ones + last_ones) + (n - 1.0) * d * d;
      sums.changes = changes_[end - 1] - changes_[begin];
    }
    return sums;
  }

 private:
  double reference_ = 0.0;
  std::vector<double> u_, uu_, lag_, iu_, changes_;
};

// A sequence of samples at rest, to which further samples may be added.
struct StillSpan {
  std::size_t first = 0;
  std::size_t end = 0;
  double start_s = 0.0;
  double end_s = 0.0;
  double motion = 0.0;  // sum of the joined variances (see StaticDetector) of the samples
  double loudest = 0.0;
  std::vector<double> reference;  // first value of each column
  std::vector<double> last;       // last value of each column
  std::vector<Sums> sums;
};

StaticInterval interval_of(const StillSpan& run) {
  const auto columns = static_cast<Eigen::Index>(run.sums.size());
  const auto n = static_cast<double>(run.end - run.first);
  StaticInterval interval{.first = run.first,
                          .end = run.end,
                          .start_s = run.start_s,
                          .end_s = run.end_s,
                          .mean = Eigen::VectorXd(columns),
                          .sd = Eigen::VectorXd(columns),
                          .effective_samples = Eigen::VectorXd(columns),
                          .drift = Eigen::VectorXd(columns),
                          .loudest = run.motion > 0.0 ? run.loudest * n / run.motion : 1.0,
                          .motion = run.motion / n};
  for (Eigen::Index c = 0; c < columns; ++c) {
    const auto at = static_cast<std::size_t>(c);
    const Sums& sums = run.sums[at];
    if (sums.changes == 0.0) {  // a constant column: exact results, without rounding errors
      interval.mean(c) = run.reference[at];
      interval.sd(c) = 0.0;
      interval.effective_samples(c) = n;
      interval.drift(c) = 0.0;
      continue;
    }
    const double mean = sums.u / n;
    const double squares = std::max(0.0, sums.uu - n * mean * mean);
    interval.mean(c) = run.reference[at] + mean;
    interval.sd(c) = n > 1.0 ? std::sqrt(squares / (n - 1.0)) : 0.0;
    const double spread = n * (n * n - 1.0) / 12.0;
    const double slope = n > 1.0 ? (sums.iu - 0.5 * (n - 1.0) * sums.u) / spread : 0.0;
    interval.drift(c) = slope * (n - 1.0);
    // `products` is the sum of (u_i - mean)(u_(i+1) - mean) over the n - 1 pairs of neighbours; the
    // first u is 0. A drift adds `drifted` to both `products` and `squares`. This is subtracted
    // from both, because a drift is not noise.
    const double last = run.last[at] - run.reference[at];
    const double products = sums.lag - mean * (2.0 * sums.u - last) + (n - 1.0) * mean * mean;
    const double drifted = slope * slope * spread;
    const double noise = squares - drifted;
    const double r = noise > 0.0 ? std::clamp((products - drifted) / noise, -0.999, 0.999) : 0.0;
    interval.effective_samples(c) = std::clamp(n * (1.0 - r) / (1.0 + r), 1.0, n);
  }
  return interval;
}

}  // namespace

class StaticDetector::Stream {
 public:
  Stream(const DetectorOptions& options, std::size_t columns)
      : options_(options), samples_(columns), prefixes_(columns) {
    if (options.window < 3 || options.detection.empty()) {
      throw DomainError(
          "StaticDetector: at least three samples in the window and one column are needed");
    }
    options_.window |= 1U;
    everything_.threshold = options.threshold.value_or(infinite);
  }

  void add(std::span<const double> time_s, const LogBlock& samples, std::span<const char> broken) {
    time_s_.insert(time_s_.end(), time_s.begin(), time_s.end());
    broken_.insert(broken_.end(), broken.begin(), broken.end());
    for (std::size_t c = 0; c < samples_.size(); ++c) {
      samples_[c].insert(samples_[c].end(), samples[c].begin(), samples[c].end());
    }
    const std::size_t reach = half() + options_.trim;
    if (time_s_.size() > emitted_ + 4 * options_.window + reach) {
      process(time_s_.size() - reach, false);
    }
  }

  std::vector<IntervalSet> finish() {
    if (emitted_ < time_s_.size()) {
      process(time_s_.size(), true);
    }
    std::vector<IntervalSet> sets;
    for (auto& [level, detector] : detectors_) {
      detector.close(options_.shortest);
      sets.push_back({.threshold = detector.threshold, .intervals = std::move(detector.intervals)});
    }
    everything_.close(options_.shortest);
    sets.push_back(
        {.threshold = everything_.threshold, .intervals = std::move(everything_.intervals)});
    return sets;
  }

 private:
  struct Detector {
    double threshold = 0.0;
    std::optional<StillSpan> run;
    std::vector<StaticInterval> intervals;

    void close(std::size_t shortest) {
      if (run && run->end - run->first >= shortest) {
        intervals.push_back(interval_of(*run));
      }
      run.reset();
    }
  };

  static constexpr std::size_t stretch = 64;
  struct Extremes {
    double quietest = 0.0;
    double loudest = 0.0;
    double motion = 0.0;
  };

  [[nodiscard]] std::size_t half() const { return options_.window / 2; }

  // Processes the samples emitted_ .. to - 1 of the buffer. Then removes the samples that no later
  // window needs.
  void process(std::size_t to, bool is_last) {
    find_motion(is_last);
    for (std::size_t c = 0; c < samples_.size(); ++c) {
      prefixes_[c].make(samples_[c], to);
    }
    const Extremes audible = survey(to);
    if (audible.quietest < infinite && !options_.threshold) {
      need_detectors(audible.quietest, audible.loudest);
    }
    for (auto& [level, detector] : detectors_) {
      follow(detector, to);
    }
    follow(everything_, to);
    emitted_ = to;
    drop();
  }

  // Computes for each sample the joined variance (motion_, see StaticDetector), and the largest
  // joined variance within `trim` samples of it (loudness_).
  void find_motion(bool is_last) {
    const std::size_t n = time_s_.size();
    const std::size_t window = std::min(options_.window, n);
    motion_.assign(n, infinite);
    if (window >= 2) {
      std::vector<std::span<const double>> columns;
      for (const std::size_t c : options_.detection) {
        columns.emplace_back(samples_[c]);
      }
      const std::size_t before = window / 2;
      const std::size_t count = n - window + 1;
      joined_sliding_variance(columns, window, std::span(motion_).subspan(before, count));
      for (std::size_t i = before; i < before + count; ++i) {
        motion_[i] = std::sqrt(motion_[i]);
      }
      if (base_ == 0) {
        std::fill_n(motion_.begin(), before, motion_[before]);
      }
      if (is_last) {
        std::fill(motion_.begin() + static_cast<std::ptrdiff_t>(before + count), motion_.end(),
                  motion_[before + count - 1]);
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (broken_[i] != 0) {
        motion_[i] = infinite;
      } else if (motion_[i] < infinite) {
        largest_ = std::max(largest_, motion_[i]);
        // If the readings in a window are all equal, the computed variance is only a rounding
        // error.
        constexpr double rounding = 1e-12;
        motion_[i] = motion_[i] < rounding * largest_ ? 0.0 : motion_[i];
      }
    }
    widen(n);
  }

  // Computes loudness_, which is the largest motion_ within +- trim samples, by the algorithm of
  // van Herk. A window covers the end of one section and the start of the next, so its maximum is
  // the larger of the maxima of these two.
  void widen(std::size_t n) {
    const std::size_t width = 2 * options_.trim + 1;
    const auto at = [&](std::size_t i) {  // motion_, or 0 beyond the ends
      return i < options_.trim || i - options_.trim >= n ? 0.0 : motion_[i - options_.trim];
    };
    const std::size_t padded = n + width - 1;
    forward_.resize(padded);
    backward_.resize(padded);
    for (std::size_t i = 0; i < padded; ++i) {
      forward_[i] = i % width == 0 ? at(i) : std::max(forward_[i - 1], at(i));
    }
    for (std::size_t i = padded; i-- > 0;) {
      backward_[i] =
          (i + 1) % width == 0 || i + 1 == padded ? at(i) : std::max(backward_[i + 1], at(i));
    }
    loudness_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      loudness_[i] = std::max(backward_[i], forward_[i + width - 1]);
    }
  }

  static int level_of(double variance) {
    return static_cast<int>(std::floor(2.0 * std::log2(variance)));
  }

  void need_detectors(double quietest, double loudest) {
    const int low = level_of(quietest) + 1;
    const int high = level_of(loudest) + 1;
    const bool first = detectors_.empty();
    for (int level = low; level <= high; ++level) {
      if (detectors_.contains(level)) {
        continue;
      }
      // If the new level is below all others, no earlier sample was below its threshold, so the new
      // detector starts without an interval. If the level is above all others, or is the first one,
      // all earlier samples except broken ones were below its threshold, so the detector starts as
      // a copy of everything_.
      Detector detector;
      if (first || level > detectors_.rbegin()->first) {
        detector = everything_;
      }
      detector.threshold = std::exp2(0.5 * level);
      detectors_.emplace(level, std::move(detector));
    }
    // Adds the levels between those of earlier blocks and those of this block.
    for (int level = detectors_.begin()->first; level < detectors_.rbegin()->first; ++level) {
      if (!detectors_.contains(level)) {
        Detector detector = std::prev(detectors_.upper_bound(level))->second;
        detector.threshold = std::exp2(0.5 * level);
        detectors_.emplace(level, std::move(detector));
      }
    }
  }

  // Computes values that all detectors use. These are the extremes of each stretch of 64 samples
  // and, for each sample, the sum of motion_ over the samples before it in the block. The sums
  // exclude samples with infinite motion, because these are never at rest.
  // @return the smallest and the largest loudness in the block, ignoring 0 and infinity.
  Extremes survey(std::size_t to) {
    Extremes audible{.quietest = infinite};
    stretches_.clear();
    motion_before_.resize(to + 1);
    motion_before_[emitted_] = 0.0;
    for (std::size_t i = emitted_; i < to; ++i) {
      if ((i - emitted_) % stretch == 0) {
        stretches_.push_back({.quietest = loudness_[i], .loudest = loudness_[i], .motion = 0.0});
      }
      Extremes& extremes = stretches_.back();
      extremes.quietest = std::min(extremes.quietest, loudness_[i]);
      extremes.loudest = std::max(extremes.loudest, loudness_[i]);
      extremes.motion = std::max(extremes.motion, motion_[i]);
      motion_before_[i + 1] = motion_before_[i] + (motion_[i] < infinite ? motion_[i] : 0.0);
      if (loudness_[i] > 0.0 && loudness_[i] < infinite) {
        audible.quietest = std::min(audible.quietest, loudness_[i]);
        audible.loudest = std::max(audible.loudest, loudness_[i]);
      }
    }
    return audible;
  }

  // @return the first sample from `i` on whose state differs from `still`; `to` if there is none. A
  //         sample is still if its loudness is below the threshold.
  [[nodiscard]] std::size_t end_of_state(std::size_t i,
                                         std::size_t to,
                                         double threshold,
                                         bool still) const {
    while (i < to) {
      const Extremes& extremes = stretches_[(i - emitted_) / stretch];
      const std::size_t end = std::min(to, i + stretch - (i - emitted_) % stretch);
      if (still ? extremes.loudest < threshold : extremes.quietest >= threshold) {
        i = end;
        continue;
      }
      for (; i < end; ++i) {
        if ((loudness_[i] < threshold) != still) {
          return i;
        }
      }
    }
    return to;
  }

  [[nodiscard]] double largest_motion(std::size_t begin, std::size_t end) const {
    double largest = 0.0;
    for (std::size_t i = begin; i < end;) {
      const bool whole = (i - emitted_) % stretch == 0 && i + stretch <= end;
      largest = std::max(largest, whole ? stretches_[(i - emitted_) / stretch].motion : motion_[i]);
      i += whole ? stretch : 1;
    }
    return largest;
  }

  void follow(Detector& detector, std::size_t to) {
    for (std::size_t i = emitted_; i < to;) {
      const bool still = loudness_[i] < detector.threshold;
      const std::size_t end = end_of_state(i + 1, to, detector.threshold, still);
      if (still) {
        extend(detector, i, end);
      } else {
        detector.close(options_.shortest);
      }
      i = end;
    }
  }

  void extend(Detector& detector, std::size_t begin, std::size_t end) {
    const std::size_t columns = samples_.size();
    if (!detector.run) {
      StillSpan& run = detector.run.emplace();
      run.first = base_ + begin;
      run.start_s = time_s_[begin];
      run.sums.resize(columns);
      for (const std::vector<double>& column : samples_) {
        run.reference.push_back(column[begin]);
      }
      run.last = run.reference;
    }
    StillSpan& run = *detector.run;
    const double origin = static_cast<double>(run.first) - static_cast<double>(base_);
    const bool goes_on = run.end > run.first;
    for (std::size_t c = 0; c < columns; ++c) {
      const Sums part = prefixes_[c].between(begin, end, run.reference[c], origin);
      Sums& sums = run.sums[c];
      sums.u += part.u;
      sums.uu += part.uu;
      sums.iu += part.iu;
      sums.lag += part.lag;
      sums.changes += part.changes;
      if (goes_on) {
        sums.changes += samples_[c][begin] != run.last[c] ? 1.0 : 0.0;
        sums.lag += (run.last[c] - run.reference[c]) * (samples_[c][begin] - run.reference[c]);
      }
      run.last[c] = samples_[c][end - 1];
    }
    run.motion += motion_before_[end] - motion_before_[begin];
    run.loudest = std::max(run.loudest, largest_motion(begin, end));
    run.end = base_ + end;
    run.end_s = time_s_[end - 1];
  }

  void drop() {
    const std::size_t reach = half() + options_.trim + 1;
    if (emitted_ <= reach) {
      return;
    }
    const std::size_t count = emitted_ - reach;
    const auto cut = [count](auto& values) {
      values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
    };
    cut(time_s_);
    cut(broken_);
    for (std::vector<double>& column : samples_) {
      cut(column);
    }
    base_ += count;
    emitted_ -= count;
  }

  DetectorOptions options_;
  std::size_t base_ = 0;     // index in the log of the buffer's first sample
  std::size_t emitted_ = 0;  // number of samples in the buffer that have been processed
  double largest_ = 0.0;     // largest joined variance so far
  std::vector<double> time_s_;
  std::vector<char> broken_;
  LogBlock samples_;
  std::vector<Prefix> prefixes_;
  std::vector<double> motion_, loudness_, forward_, backward_;
  std::vector<Extremes> stretches_;
  std::vector<double> motion_before_;
  std::map<int, Detector> detectors_;  // detectors by level; the threshold is 2^(level / 2)
  Detector everything_;
};

StaticDetector::StaticDetector(const DetectorOptions& options, std::size_t columns)
    : stream_(std::make_unique<Stream>(options, columns)) {}
StaticDetector::~StaticDetector() = default;
StaticDetector::StaticDetector(StaticDetector&&) noexcept = default;
StaticDetector& StaticDetector::operator=(StaticDetector&&) noexcept = default;

void StaticDetector::add(std::span<const double> time_s,
                         const LogBlock& samples,
                         std::span<const char> broken) {
  stream_->add(time_s, samples, broken);
}

std::vector<IntervalSet> StaticDetector::finish() {
  return stream_->finish();
}

std::size_t most_persistent(const std::vector<IntervalSet>& sets) {
  const auto count = [&](std::size_t i) { return static_cast<double>(sets[i].intervals.size()); };
  std::size_t best = sets.size() - 1;
  // If the joined variance stays within a factor of about 16, the whole log is one rest.
  constexpr std::size_t levels_of_noise = 8;
  if (sets.size() - 1 <= levels_of_noise) {
    return best;
  }
  // A plateau is a range of thresholds with nearly the same number of rests. The lowest plateau of
  // at least `wide_enough` thresholds is used. If there is none, the widest plateau is used. A
  // higher plateau may be due to a single glitch far above all motion. Plateaus with one rest are
  // considered last, because any large threshold gives one rest.
  constexpr std::size_t wide_enough = 6;
  std::size_t widest = 0;
  for (const double fewest : {2.0, 1.0}) {
    for (std::size_t i = 0; i + 1 < sets.size(); ++i) {
      const double n = count(i);
      if (n < fewest) {
        continue;
      }
      std::size_t up = i;
      while (up + 2 < sets.size() && std::abs(count(up + 1) - n) <= 0.05 * n) {
        ++up;
      }
      const std::size_t width = up - i + 1;
      if (width > widest) {
        widest = width;
        // The chosen threshold is somewhat above the lower end of the plateau. At the lower end,
        // noise shortens the rests. Far above it, the rests include motion.
        best = i + std::min<std::size_t>(3, (width - 1) / 2);
      }
      if (width >= wide_enough) {
        return best;
      }
    }
    if (widest > 0) {
      break;
    }
  }
  return best;
}

std::size_t join_split_rests(std::vector<StaticInterval>& intervals,
                             const std::vector<std::size_t>& columns,
                             double longest_gap_s,
                             double tolerance) {
  const auto agree = [&](const StaticInterval& a, const StaticInterval& b) {
    return std::all_of(columns.begin(), columns.end(), [&](std::size_t column) {
      const auto c = static_cast<Eigen::Index>(column);
      const double se = std::hypot(a.sd(c) / std::sqrt(a.effective_samples(c)),
                                   b.sd(c) / std::sqrt(b.effective_samples(c)));
      return std::abs(a.mean(c) - b.mean(c)) <= std::max(5.0 * se, tolerance);
    });
  };
  std::size_t joined = 0;
  std::vector<StaticInterval> kept;
  for (StaticInterval& next : intervals) {
    if (kept.empty() || next.start_s - kept.back().end_s > longest_gap_s ||
        !agree(kept.back(), next)) {
      kept.push_back(std::move(next));
      continue;
    }
    // Only the longer of the two rests is kept. The samples of the knock between them are left out.
    if (next.samples() > kept.back().samples()) {
      kept.back() = std::move(next);
    }
    ++joined;
  }
  intervals = std::move(kept);
  return joined;
}

}  // namespace axiscal
