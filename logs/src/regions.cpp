// SPDX-License-Identifier: Apache-2.0
#include "axiscal/logs/regions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/field/turntable_field.hpp"
#include "axiscal/logs/seats.hpp"
#include "axiscal/logs/settings.hpp"
#include "axiscal/logs/table_text.hpp"
#include "axiscal/logs/time_column.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

Eigen::Vector3d up_of(Face rest) {  // up points away from the face on the table
  const bool is_plus = static_cast<int>(rest) % 2 == 0;
  return (is_plus ? -1.0 : 1.0) * Eigen::Vector3d::Unit(axis_of(rest));
}

std::optional<Face> face_member(const JsonValue& region, const char* name) {
  const auto value = region.find(name);
  if (!value) {
    return std::nullopt;
  }
  const std::optional<Face> face = parse_face(value->text());
  if (!face) {
    value->fail("is not a face; the faces are +X -X +Y -Y +Z -Z");
  }
  return face;
}

// @return the region for a region name of the library imucal, such as "x_p", "y_a" or "z_rot";
//         nullopt for other names.
std::optional<Region> region_called(std::string_view name) {
  if (name.size() < 3 || name[1] != '_' || name[0] < 'x' || name[0] > 'z') {
    return std::nullopt;
  }
  const int axis = name[0] - 'x';
  const std::string_view what = name.substr(2);
  const Face below = static_cast<Face>(2 * axis + 1);  // face on the table if the axis points up
  if (what == "p") {
    return Region{.name = std::string(name), .rest = below};
  }
  if (what == "a") {
    return Region{.name = std::string(name), .rest = static_cast<Face>(2 * axis)};
  }
  if (what == "rot") {
    return Region{.kind = Region::Kind::turn,
                  .name = std::string(name),
                  .rest = below,
                  .turns = 1.0,
                  .sense_is_open = true};
  }
  return std::nullopt;
}

// The samples of a region, which have the indices `first` to `end` - 1.
struct Part {
  std::size_t first = 0, end = 0;
};

class RegionReader {
 public:
  RegionReader(const RecordedLog& log, const ImuOptions& options) : log_(log) {
    const std::size_t n = log.samples.empty() ? 0 : log.samples.front().size();
    const std::optional<TimeColumn> time =
        options.segment.rate_hz ? std::nullopt
                                : find_time_column(log.name, log.columns, options.segment.time);
    if (time) {
      const std::vector<double>& times = log.samples[time->position];
      const double seconds = settle_time_unit(log.name, *time, times).seconds;
      for (const double t : times) {
        time_s_.push_back((t - times.front()) * seconds);
      }
      time_column_ = time->position;
    } else if (options.segment.rate_hz) {
      for (std::size_t i = 0; i < n; ++i) {
        time_s_.push_back(static_cast<double>(i) / *options.segment.rate_hz);
      }
    } else {
      throw DataError(log.name, "has neither times nor a rate",
                      {settings::time_column, settings::rate});
    }
  }

  [[nodiscard]] Part part_of(const Region& region) const {
    const std::size_t n = time_s_.size();
    Part part{.first = region.start.value_or(0), .end = region.end.value_or(n)};
    if (region.start_s) {
      part.first = sample_at(*region.start_s);
    }
    if (region.end_s) {
      part.end = sample_at(*region.end_s);
    }
    if (!(part.first + 1 < part.end) || part.end > n) {
      throw DataError(
          log_.name,
          formatted(
              "the region from sample {} to {} is empty, or exceeds the {} samples of the log{}",
              part.first, part.end, n, region.name.empty() ? "" : " (" + region.name + ")"));
    }
    return part;
  }

  [[nodiscard]] double mean(const std::string& column, const Part& part) const {
    const std::vector<double>& values = values_of(column);
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = part.first; i < part.end; ++i) {
      if (std::isfinite(values[i])) {
        sum += values[i];
        count += 1.0;
      }
    }
    return sum / count;
  }

  [[nodiscard]] double sd(const std::string& column, const Part& part) const {
    const std::vector<double>& values = values_of(column);
    const double middle = mean(column, part);
    double squares = 0.0;
    double count = 0.0;
    for (std::size_t i = part.first; i < part.end; ++i) {
      if (std::isfinite(values[i])) {
        squares += (values[i] - middle) * (values[i] - middle);
        count += 1.0;
      }
    }
    return count > 1.0 ? std::sqrt(squares / (count - 1.0)) : 0.0;
  }

  [[nodiscard]] Eigen::Vector3d mean(const std::vector<std::string>& columns,
                                     const Part& part) const {
    return {mean(columns[0], part), mean(columns[1], part), mean(columns[2], part)};
  }

  /// @return the duration of a part [s]: its number of samples times their mean step.
  [[nodiscard]] double duration_s(const Part& part) const {
    const auto n = static_cast<double>(part.end - part.first);
    return (time_s_[part.end - 1] - time_s_[part.first]) * n / (n - 1.0);
  }

  [[nodiscard]] double time_s(std::size_t sample) const { return time_s_[sample]; }
  [[nodiscard]] double rate_hz() const {
    return static_cast<double>(time_s_.size() - 1) / (time_s_.back() - time_s_.front());
  }
  [[nodiscard]] std::size_t samples() const { return time_s_.size(); }

 private:
  [[nodiscard]] std::size_t sample_at(double time_s) const {
    return static_cast<std::size_t>(std::lower_bound(time_s_.begin(), time_s_.end(), time_s) -
                                    time_s_.begin());
  }

  [[nodiscard]] const std::vector<double>& values_of(const std::string& column) const {
    return log_.samples[need_column(log_.name, log_.columns, column)];
  }

  const RecordedLog& log_;
  std::vector<double> time_s_;
  std::optional<std::size_t> time_column_;
};

struct KnownRegion {
  const Region* region = nullptr;
  Part part;
};

class RegionCalibrator {
 public:
  RegionCalibrator(const RecordedLog& log,
                   const std::vector<Region>& regions,
                   const ImuOptions& options)
      : log_(log), options_(options), reader_(log, options) {
    for (const Region& region : regions) {
      (region.kind == Region::Kind::rest ? rests_ : turns_)
          .push_back({.region = &region, .part = reader_.part_of(region)});
    }
    if (rests_.empty()) {
      throw RefusedError("the regions contain no rest");
    }
  }

  ImuCalibration run() {
    describe_rests();
    calibrate_accelerometer();
    if (!options_.gyroscope.empty() && !turns_.empty()) {
      try {
        calibrate_gyroscope();
      } catch (const RefusedError& error) {
        result_.failed.push_back({.slot = "gyroscope", .message = error.what()});
      }
    } else if (!options_.gyroscope.empty()) {
      result_.notes.emplace_back("the regions contain no turn, so the gyroscope is not calibrated");
    }
    result_.notes.push_back(
        formatted("the regions contain {} rests and {} turns", rests_.size(), turns_.size()));
    result_.notes.insert(result_.notes.end(), log_.notes.begin(), log_.notes.end());
    return std::move(result_);
  }

 private:
  void describe_rests() {
    result_.rests.rate_hz = reader_.rate_hz();
    result_.rests.samples = reader_.samples();
    for (const KnownRegion& rest : rests_) {
      StaticInterval& interval = result_.rests.intervals.emplace_back();
      interval.first = rest.part.first;
      interval.end = rest.part.end;
      interval.start_s = reader_.time_s(rest.part.first);
      interval.end_s = reader_.time_s(rest.part.end - 1);
    }
  }

  [[nodiscard]] Observations readings_of(const std::vector<std::string>& columns,
                                         const std::vector<KnownRegion>& parts) const {
    Observations observations;
    const auto n = static_cast<Eigen::Index>(parts.size());
    observations.response = Eigen::MatrixXd(n, 3);
    observations.samples = Eigen::VectorXd(n);
    observations.response_sd = Eigen::MatrixXd(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const KnownRegion& known = parts[static_cast<std::size_t>(i)];
      Reading& reading = observations.readings.emplace_back();
      reading.run = static_cast<int>(i) + 1;
      reading.time_s =
          0.5 * (reader_.time_s(known.part.first) + reader_.time_s(known.part.end - 1));
      observations.response.row(i) = reader_.mean(columns, known.part).transpose();
      (*observations.samples)(i) = static_cast<double>(known.part.end - known.part.first);
      for (Eigen::Index k = 0; k < 3; ++k) {
        (*observations.response_sd)(i, k) =
            std::max(reader_.sd(columns[static_cast<std::size_t>(k)], known.part), 1e-300);
      }
    }
    return observations;
  }

  void calibrate_accelerometer() {
    if (options_.known_accelerometer) {
      result_.accelerometer = *options_.known_accelerometer;
      result_.accelerometer_was_known = true;
      return;
    }
    Experiment experiment = options_.experiment;
    experiment.instrument.kind = "accelerometer";
    experiment.instrument.axes = options_.accelerometer;
    set_default_field(experiment);
    experiment.fit.weighting = experiment.fit.weighting.value_or(Weighting::none);
    Observations observations = readings_of(options_.accelerometer, rests_);
    const auto all_have = [&](auto has) {
      return std::all_of(rests_.begin(), rests_.end(),
                         [&](const KnownRegion& rest) { return has(*rest.region); });
    };
    const bool have_faces = all_have([](const Region& region) { return region.rest.has_value(); });
    const bool have_seats =
        have_faces && all_have([](const Region& region) { return region.fence.has_value(); });
    if (have_seats) {
      for (std::size_t i = 0; i < rests_.size(); ++i) {
        const Region& region = *rests_[i].region;
        if (axis_of(*region.rest) == axis_of(*region.fence)) {
          throw DataError(
              log_.name,
              formatted("region {}: the faces 'rest' and 'fence' belong to the same axis", i + 1));
        }
        observations.readings[i].point = DesignPoint(*region.rest, *region.fence);
      }
    } else if (have_faces) {
      std::vector<std::optional<Face>> faces;
      for (const KnownRegion& rest : rests_) {
        faces.push_back(rest.region->rest);
      }
      assume_level_table(make_field_description(experiment).magnitude, faces, observations);
      experiment.fit.method = experiment.fit.method.value_or(Method::known);
      result_.notes.emplace_back(
          "the regions name only the face on the table: the table is assumed to be level, so the "
          "actual slope of the table changes the biases");
    }
    result_.accelerometer = calibrate(experiment, observations);
    result_.accelerometer.provenance.slot = "accelerometer";
  }

  // @return the mean reading of the gyroscope over the rests in which gravity has nearly the same
  //         direction as during a turn. If there are no such rests, the mean over all rests.
  [[nodiscard]] Eigen::Vector3d rest_like(const KnownRegion& turn) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 0.0;
    const Eigen::Vector3d gravity = reader_.mean(options_.accelerometer, turn.part);
    const Eigen::Vector3d middle = result_.accelerometer.sensor.response.bias;
    for (const KnownRegion& rest : rests_) {
      constexpr double nearly = 0.9;  // cosine of the largest angle between the two directions
      const Eigen::Vector3d there = reader_.mean(options_.accelerometer, rest.part) - middle;
      const bool is_alike = there.normalized().dot((gravity - middle).normalized()) > nearly;
      if (is_alike) {
        sum += reader_.mean(options_.gyroscope, rest.part);
        count += 1.0;
      }
    }
    return count > 0.0 ? Eigen::Vector3d(sum / count) : mean_rest_;
  }

  void calibrate_gyroscope() {
    for (const KnownRegion& rest : rests_) {
      mean_rest_ +=
          reader_.mean(options_.gyroscope, rest.part) / static_cast<double>(rests_.size());
    }
    std::vector<KnownRegion> parts = rests_;
    parts.insert(parts.end(), turns_.begin(), turns_.end());
    Observations observations = readings_of(options_.gyroscope, parts);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      observations.readings[i].field_in_sensor = Eigen::Vector3d::Zero();
      if (parts[i].region->kind == Region::Kind::turn) {
        const auto row = static_cast<Eigen::Index>(i);
        // The bias depends on the attitude. Subtracting the difference between the bias in the
        // turn's attitude and the mean bias over all rests leaves the mean bias in the reading.
        observations.response.row(row) -= (rest_like(parts[i]) - mean_rest_).transpose();
        observations.readings[i].field_in_sensor =
            rate_of(parts[i], observations.response.row(row).transpose() - mean_rest_);
      }
    }
    double sum = 0.0;
    for (const Reading& reading : observations.readings) {
      sum += reading.field_in_sensor->norm();
    }
    Experiment experiment;
    experiment.instrument = {.kind = "gyroscope",
                             .serial = options_.experiment.instrument.serial,
                             .axes = options_.gyroscope,
                             .unit = options_.gyroscope_unit};
    experiment.field = TurntableField(sum / static_cast<double>(observations.size()), "rad/s");
    experiment.fit.method = Method::known;
    experiment.fit.weighting = Weighting::none;
    experiment.fit.search_for_mistakes = false;
    Calibration record = calibrate(experiment, observations);
    record.provenance.slot = "gyroscope";
    result_.gyroscope = std::move(record);
  }

  // @param readings  mean of the gyroscope during the turn, after subtraction of its bias.
  // @return the mean angular rate during the turn, in the cube's frame [rad/s].
  [[nodiscard]] Eigen::Vector3d rate_of(const KnownRegion& turn,
                                        const Eigen::Vector3d& readings) const {
    const Region& region = *turn.region;
    if (!region.rest) {
      throw DataError(
          log_.name,
          formatted("region '{}': a turn must have the member 'rest' (the face on the table)",
                    region.name));
    }
    const Eigen::Vector3d up = up_of(*region.rest);
    const double duration_s = reader_.duration_s(turn.part);
    const double along = up.dot(readings);
    double turns = region.turns.value_or(1.0);
    if (!region.turns && options_.turns.rate_per_unit) {
      turns =
          std::round(along * *options_.turns.rate_per_unit * duration_s / (2.0 * std::numbers::pi));
    } else if (region.sense_is_open || !region.turns) {
      turns = std::copysign(turns, along);
    }
    if (turns == 0.0) {
      throw RefusedError(formatted("region '{}' contains no whole turn", region.name));
    }
    return up * (2.0 * std::numbers::pi * turns / duration_s);
  }

  const RecordedLog& log_;
  const ImuOptions& options_;
  RegionReader reader_;
  std::vector<KnownRegion> rests_, turns_;
  Eigen::Vector3d mean_rest_ = Eigen::Vector3d::Zero();
  ImuCalibration result_;
};

}  // namespace

std::vector<Region> read_regions(const std::string& path) {
  const JsonValue json = parse_json(read_whole_file(path), path);
  json.require_format("axiscal-regions");
  std::vector<Region> regions;
  for (const JsonValue& one : json.at("regions").elements()) {
    Region& region = regions.emplace_back();
    const std::string kind = one.at("kind").text();
    if (kind != "rest" && kind != "turn") {
      one.at("kind").fail("must be 'rest' or 'turn'");
    }
    region.kind = kind == "turn" ? Region::Kind::turn : Region::Kind::rest;
    if (one.find("start_sample")) {
      region.start = one.at("start_sample").count();
      region.end = one.at("end_sample").count();
    } else {
      region.start_s = one.at("start").number();
      region.end_s = one.at("end").number();
    }
    region.rest = face_member(one, "rest");
    region.fence = face_member(one, "fence");
    if (const auto turns = one.find("turns")) {
      region.turns = turns->number();
      if (*region.turns == 0.0) {
        turns->fail("must not be 0");
      }
    }
    if (const auto name = one.find("name")) {
      region.name = name->text();
    } else {
      region.name = formatted("{}", regions.size());
    }
  }
  if (regions.empty()) {
    json.at("regions").fail("must have one region or more");
  }
  return regions;
}

std::vector<Region> read_region_column(const std::string& path, const std::string& column) {
  TableText text(path);
  CsvReader csv = text.reader({column});
  const std::size_t place = csv.need(column);
  std::vector<Region> regions;
  std::string last;
  std::optional<Region> current;
  std::size_t sample = 0;
  const auto end_region = [&] {
    if (current) {
      current->end = sample;
      regions.push_back(*current);
    }
  };
  for (CsvReader::Row row = csv.next(); row != CsvReader::Row::end; row = csv.next()) {
    if (row == CsvReader::Row::defective) {
      throw DataError(csv.path(), csv.line(), csv.defect());
    }
    const std::string_view name = csv.cells()[place];
    if (name != last || sample == 0) {
      end_region();
      last = name;
      current = region_called(name);
      if (current) {
        current->start = sample;
      }
    }
    ++sample;
  }
  end_region();
  if (regions.empty()) {
    throw DataError(path, formatted("column '{}' contains no name of a region, such as x_p, x_a, "
                                    "x_rot",
                                    column));
  }
  return regions;
}

ImuCalibration calibrate_regions(const RecordedLog& log,
                                 const std::vector<Region>& regions,
                                 const ImuOptions& options) {
  return RegionCalibrator(log, regions, options).run();
}

}  // namespace axiscal
