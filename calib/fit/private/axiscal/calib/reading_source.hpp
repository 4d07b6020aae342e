// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/calib/reading_set.hpp"

namespace axiscal {

/// The observations of an experiment in the terms of the estimators: which are used, by what
/// weight, and how the instrument lay in each.
class ReadingSource {
 public:
  /// @param by_field  whether the readings bring their fields and no design point counts.
  /// @throws SetupError, RefusedError  for runs that are not there, no readings, missing weights.
  ReadingSource(const Experiment& experiment,
                const Observations& observations,
                Weighting weighting,
                bool by_field);

  /// @return the rows of the observations that are used, in their order.
  [[nodiscard]] const std::vector<std::size_t>& rows() const { return rows_; }

  /// Leaves out whole readings that some axis cannot use; for methods that need all axes.
  void keep_complete_rows();

  /// The readings, with the weights of those that an axis does not see set to 0.
  /// @param seen  one row for each of rows(); empty: all that are not saturated.
  [[nodiscard]] ReadingSet set(const std::vector<FieldDescription>& parts,
                               const AxisMask& seen) const;

  /// The readings that are kept out of the fit to confirm it, in the terms of the set that was
  /// fitted: weighed as its readings are, with its temperature terms and its run's effects. A
  /// block that it does not know is taken as the mean of those it knows.
  [[nodiscard]] ReadingSet kept_out(const ReadingSet& fitted) const;

  /// From now on set() has temperature terms of this order.
  /// @param reference  t0, of every sensor; nothing: the mean of the readings that are used.
  void set_temperature(int order, std::optional<double> reference);

  /// From now on set() has these effects of the run; blocks only without temperature terms, which
  /// they would take the place of.
  /// @return whether that is a change.
  bool set_effects(EffectSetup effects);

  /// From now on the instrument sits in the cube in each of these mounts turned once more.
  /// @param turns  exp([d]x) by the mount's number, f_sensor -> exp([d]x) f_sensor; empty: takes
  ///               all turns back.
  void turn_mounts(const std::map<int, Eigen::Matrix3d>& turns);

  /// How the mounts are turned in all.
  [[nodiscard]] const std::map<int, Eigen::Matrix3d>& mount_turns() const { return mount_turns_; }

  /// What the readings that are used saw of the temperature sensors, as TemperatureResponse.
  [[nodiscard]] const std::vector<TemperatureSpan>& temperature_spans() const { return spans_; }

  /// How the instrument lies: rotation_sensor_from_table.
  [[nodiscard]] Eigen::Matrix3d rotation(const Reading& reading) const;

  /// As ReadingSet::field_then; the identity where the field stays.
  [[nodiscard]] Eigen::Matrix3d field_then(const Reading& reading) const;

  /// @return which readings of all observations are within the range of an axis.
  [[nodiscard]] const AxisMask& in_range() const { return in_range_; }

  /// @return mean time of the readings, where the field moves and they have times.
  [[nodiscard]] std::optional<double> mean_time_s() const { return mean_time_s_; }

  /// @return the second fields, which are known in the table.
  [[nodiscard]] const std::vector<FieldDescription>& also() const { return also_; }

  [[nodiscard]] bool by_field() const { return by_field_; }

  /// The field of a reading in the sensor's frame.
  /// @param fields  as Estimate::field.
  [[nodiscard]] Eigen::Vector3d field_in_sensor(const Reading& reading,
                                                const TableField& field) const;

 private:
  void put_readings(const std::vector<std::size_t>& rows, ReadingSet& set) const;
  void put_temperature(ReadingSet& set) const;
  void find_also();
  void find_rows();
  void find_range();
  void find_mean_time();

  const Experiment& experiment_;
  const Observations& observations_;
  bool by_field_;
  Eigen::MatrixXd weights_;
  std::vector<std::size_t> rows_;
  std::vector<std::size_t> rows_kept_out_;
  std::vector<FieldDescription> also_;
  std::vector<int> blocks_;  // those of the readings used, where each has its own levelness
  AxisMask in_range_;
  std::optional<double> mean_time_s_;
  int temperature_order_ = 0;
  EffectSetup effects_;
  std::map<int, Eigen::Matrix3d> mount_turns_;
  std::vector<TemperatureSpan> spans_;  // of one temperature sensor, or of each axis's own
};

}  // namespace axiscal
