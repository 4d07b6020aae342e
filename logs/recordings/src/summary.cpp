// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "axiscal/core/not_a_number.hpp"
#include "axiscal/logs/recording_file.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "core/json_document.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/text_encoding.hpp"
#include "logs/recordings/src/text_layout.hpp"

namespace axiscal {
namespace {

// Accumulates mean and standard deviation (B. P. Welford, Technometrics 4 (1962)).
struct Moments {
  double count = 0.0, mean = 0.0, squares = 0.0;

  void add(double value) {
    count += 1.0;
    const double off = value - mean;
    mean += off / count;
    squares += off * (value - mean);
  }
  [[nodiscard]] double sd() const {
    return count > 1.0 ? std::sqrt(squares / (count - 1.0)) : not_a_number;
  }
};

// A histogram of the differences between successive times.
class Steps {
 public:
  void add(double step_s) {
    if (step_s < 0.0) {
      ++back_;
    } else if (step_s > 0.0) {
      const double place = (std::log2(step_s) - smallest) * bins_an_octave;
      const auto bin =
          static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(bins_.size() - 1)));
      ++bins_[bin];
      sums_[bin] += step_s;
      sum_ += step_s;
      ++count_;
    } else if (step_s == 0.0) {
      ++zero_;
    }
  }

  /// @return the number of steps that are longer than five times the usual step, or negative.
  [[nodiscard]] std::size_t gaps() const {
    const double limit = longest_usual_s();
    std::size_t longer = back_;
    for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
      longer += start_of(bin) >= limit ? bins_[bin] : 0;
    }
    return longer;
  }

  [[nodiscard]] double sum_s() const { return sum_; }

  /// @return steps per second, excluding gaps.
  [[nodiscard]] double rate_hz() const {
    const double limit = longest_usual_s();
    double sum = 0.0;
    double count = static_cast<double>(zero_);
    for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
      if (start_of(bin) < limit) {
        sum += sums_[bin];
        count += static_cast<double>(bins_[bin]);
      }
    }
    return sum > 0.0 ? count / sum : not_a_number;
  }

 private:
  static double start_of(std::size_t bin) {
    return std::exp2(smallest + static_cast<double>(bin) / bins_an_octave);
  }

  [[nodiscard]] double longest_usual_s() const {
    // The median step determines the usual step.
    std::size_t passed = 0;
    std::size_t middle = 0;
    while (middle + 1 < bins_.size() && 2 * (passed += bins_[middle]) < count_) {
      ++middle;
    }
    const double middle_s =
        std::exp2(smallest + (static_cast<double>(middle) + 1.0) / bins_an_octave);
    // Samples that arrive in bursts have many short steps, so the mean is used if it is larger.
    const double mean_s = count_ > 0 ? sum_ / static_cast<double>(count_) : 0.0;
    constexpr double far = 5.0;
    return far * std::max(middle_s, std::min(mean_s, far * middle_s));
  }

  static constexpr double smallest = -34.0;  // log2 of the smallest step in s, which is 0.06 ns
  static constexpr double bins_an_octave = 4.0;
  std::array<std::size_t, 256> bins_{};
  std::array<double, 256> sums_{};
  double sum_ = 0.0;
  std::size_t count_ = 0, back_ = 0, zero_ = 0;
};

constexpr double window_s = 0.5;
constexpr double still_m_s2 = 0.08;

// Finds the longest sequence of windows in which an accelerometer is at rest.
class Stillness {
 public:
  // @param si  factor that converts the samples to m/s^2. If it is 0, the unit is not known, and
  //            the mean vector of a window is assumed to have the magnitude of gravity.
  explicit Stillness(double si) : si_(si) {}

  void add(double from_first_s, std::span<const double> values) {
    if (!std::isfinite(from_first_s)) {
      return;
    }
    const double window = std::floor(from_first_s / window_s);  // may exceed the range of integers
    if (window != window_) {
      end_window();
      window_ = window;
      moments_.assign(values.size(), {});
    }
    for (std::size_t c = 0; c < values.size(); ++c) {
      if (std::isfinite(values[c])) {
        moments_[c].add(values[c]);
      }
    }
  }

  void finish() { end_window(); }

  double from_s = 0.0, to_s = 0.0;

 private:
  void end_window() {
    if (moments_.empty()) {
      return;
    }
    double length = 0.0;
    double loudest = 0.0;
    double fewest = moments_.front().count;
    for (const Moments& one : moments_) {
      length = std::hypot(length, one.mean);
      loudest = std::max(loudest, one.sd());
      fewest = std::min(fewest, one.count);
    }
    constexpr double g0 = 9.80665;
    const double si = si_ > 0.0 ? si_ : length > 0.0 ? g0 / length : 1.0;
    const bool is_still = fewest >= 3.0 && loudest * si < still_m_s2;
    if (is_still && window_ == last_still_ + 1 && last_still_ >= first_still_) {
      last_still_ = window_;
    } else if (is_still) {
      first_still_ = last_still_ = window_;
    }
    if (is_still) {
      const double length_s = (last_still_ - first_still_ + 1.0) * window_s;
      if (length_s > to_s - from_s) {
        from_s = first_still_ * window_s;
        to_s = from_s + length_s;
      }
    }
    moments_.clear();
  }

  double si_;
  double window_ = -1.0;
  double first_still_ = 0.0, last_still_ = -1.0;
  std::vector<Moments> moments_;
};

class Summariser final : public SeriesSink {
 public:
  void add(const Series& series) override {
    One& one = all_.emplace_back();
    one.summary.series = series;
    one.moments.resize(series.columns.size());
    one.summary.missing.assign(series.columns.size(), 0);
    if (series.kind == SeriesKind::accelerometer) {
      const auto unit = known_unit(series.unit, series.kind);
      one.still.emplace(unit ? unit->si : 0.0);
    }
  }

  void sample(std::size_t series, double time_s, std::span<const double> values) override {
    One& one = all_[series];
    SeriesSummary& summary = one.summary;
    ++samples_;
    if (summary.samples++ == 0) {
      summary.start_s = time_s;
    } else {
      one.steps.add(time_s - summary.end_s);
    }
    summary.end_s = time_s;
    for (std::size_t c = 0; c < values.size(); ++c) {
      if (std::isfinite(values[c])) {
        one.moments[c].add(values[c]);
      } else {
        ++summary.missing[c];
      }
    }
    if (one.still) {
      one.still->add(time_s - summary.start_s, values);
    }
  }

  [[nodiscard]] std::size_t samples() const { return samples_; }

  std::vector<SeriesSummary> finish() {
    std::vector<SeriesSummary> summaries;
    for (One& one : all_) {
      SeriesSummary& summary = one.summary;
      const double span = summary.end_s - summary.start_s;
      summary.gaps = one.steps.gaps();
      // If the times restart within the series, the rate is computed from the steps, because the
      // time from the first sample to the last is too short.
      constexpr double nearly_all = 0.75;
      const bool began_anew = span < nearly_all * one.steps.sum_s();
      summary.rate_hz = summary.samples < 2 ? not_a_number
                        : began_anew        ? one.steps.rate_hz()
                        : span > 0.0        ? static_cast<double>(summary.samples - 1) / span
                                            : not_a_number;
      for (const Moments& moments : one.moments) {
        summary.mean.push_back(moments.count > 0.0 ? moments.mean : not_a_number);
        summary.sd.push_back(moments.sd());
      }
      if (one.still) {
        one.still->finish();
        summary.still_from_s = one.still->from_s;
        summary.still_to_s = one.still->to_s;
      }
      summaries.push_back(std::move(summary));
    }
    return summaries;
  }

 private:
  struct One {
    SeriesSummary summary;
    std::vector<Moments> moments;
    std::optional<Stillness> still;
    Steps steps;
  };
  std::vector<One> all_;
  std::size_t samples_ = 0;
};

}  // namespace

RecordingSummary summarise(RecordingFile::Decoder& decoder,
                           std::optional<std::size_t> most_samples) {
  Summariser summariser;
  while (decoder.read(summariser) && (!most_samples || summariser.samples() < *most_samples)) {
  }
  return {.format = decoder.format,
          .series = summariser.finish(),
          .notes = decoder.notes(),
          .facts = decoder.facts};
}

RecordingSummary summarise(const std::string& path,
                           std::optional<std::size_t> most_samples,
                           const ReadLimits& limits) {
  return summarise(*series_of(open_recording(path, limits)), most_samples);
}

std::string recording_json(const RecordingSummary& summary) {
  // Names in a damaged file may not be valid UTF-8.
  const auto utf8 = [](const std::vector<std::string>& texts) {
    std::vector<std::string> clean;
    for (const std::string& text : texts) {
      clean.push_back(utf8_of_latin1(text));
    }
    return clean;
  };
  Json json = {{"format", summary.format}, {"series", Json::array()}};
  for (const SeriesSummary& one : summary.series) {
    Json series = {{"name", utf8_of_latin1(one.series.name)},
                   {"instance", one.series.instance},
                   {"kind", std::string(name_of(one.series.kind))},
                   {"columns", utf8(one.series.columns)},
                   {"unit", utf8_of_latin1(one.series.unit)},
                   {"samples", one.samples},
                   {"start_s", one.start_s},
                   {"end_s", one.end_s},
                   {"rate_hz", one.rate_hz},
                   {"gaps", one.gaps},
                   {"missing", one.missing},
                   {"mean", one.mean},
                   {"sd", one.sd}};
    if (one.series.kind == SeriesKind::accelerometer) {
      series["still_s"] = {one.still_from_s, one.still_to_s};
    }
    json["series"].push_back(std::move(series));
  }
  json["notes"] = utf8(summary.notes);
  json["facts"] = Json::object();
  for (const auto& [name, value] : summary.facts) {
    json["facts"][utf8_of_latin1(name)] = utf8_of_latin1(value);
  }
  return json_text(json);
}

}  // namespace axiscal
