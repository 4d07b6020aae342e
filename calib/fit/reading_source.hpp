// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/observations.hpp"
#include "calib/fit/reading_set.hpp"

namespace axiscal {

/// The parts of a model that depend on the run.
struct ModelChoice {
  int temperature_order = 0;  ///< 0: no temperature terms
  /// reference temperature of all temperature sensors; nullopt: the mean of each sensor over the
  /// readings
  std::optional<double> temperature_reference;
  /// effects of the run; effects.blocks is ignored if there are temperature terms
  EffectSetup effects;
  /// for Weighting::samples: the fraction of a reading's mean variance that does not decrease with
  /// the number of samples
  double variance_floor = 0.0;
  /// rotation of the instrument in each mount; may be empty
  std::map<int, Eigen::Matrix3d> mounts;
};

/// The variance of a reading in units of the mean variance (method.md, section 4.1).
/// @param floor       the fraction of the mean variance that more samples do not reduce.
/// @param by_samples  1 / (number of samples), divided by its mean over the readings.
template <typename Value>
[[nodiscard]] Value variance_of_samples(double floor, const Value& by_samples) {
  return floor + (1.0 - floor) * by_samples;
}

/// Converts the observations of an experiment to the input of the estimators: selects the readings,
/// and computes their weights and the orientation of the instrument at each reading.
class ReadingSource {
 public:
  /// @param experiment, observations  must outlive the source and its copies.
  /// @param by_field  true if each reading has its own given field; design points are then ignored.
  /// @throws SetupError, RefusedError  if a reading to leave out does not exist, if none remain,
  ///                                   or if weights are missing.
  ReadingSource(const Experiment& experiment,
                const Observations& observations,
                Weighting weighting,
                bool by_field);

  /// @return a source of the same readings for another model.
  [[nodiscard]] ReadingSource with(ModelChoice choice) const;

  /// @return the source without the readings that are out of range on one or more axes.
  [[nodiscard]] ReadingSource with_complete_rows() const;

  [[nodiscard]] const ModelChoice& choice() const { return choice_; }

  /// @return the rows of the observations that are used, in their order.
  [[nodiscard]] const std::vector<std::size_t>& rows() const { return selection_->rows; }

  /// @return the readings with the columns of the model. The weight is 0 if an axis does not use a
  ///         reading.
  /// @param seen  n x m, a row for each entry of rows(): true if the axis uses the reading. If
  ///              empty, each axis uses all readings within its range.
  [[nodiscard]] ReadingSet set(const std::vector<FieldDescription>& parts,
                               const AxisMask& seen) const;

  /// @return the readings that are kept out of the fit to confirm it, with the same model as the
  ///         set that was fitted. A block that is not in the fit gets the mean bias of the fitted
  ///         blocks.
  [[nodiscard]] ReadingSet kept_out(const ReadingSet& fitted) const;

  /// @return the span of each temperature sensor over the readings, see TemperatureResponse::spans.
  [[nodiscard]] const std::vector<TemperatureSpan>& temperature_spans() const { return spans_; }

  /// @return rotation_sensor_from_table of a reading.
  [[nodiscard]] Eigen::Matrix3d rotation(const Reading& reading) const;

  /// @return the matrix ReadingSet::field_then of a reading; the identity if the field is constant.
  [[nodiscard]] Eigen::Matrix3d field_then(const Reading& reading) const;

  /// @return a row for each observation and a column for each axis: true if the reading is within
  ///         the range of the axis.
  [[nodiscard]] const AxisMask& in_range() const { return selection_->in_range; }

  /// @return the mean time of the readings; nullopt if the field is constant, or if a reading has
  ///         no time.
  [[nodiscard]] std::optional<double> mean_time_s() const { return selection_->mean_time_s; }

  /// @return the second fields (Experiment::also), whose vectors in the table's frame are known.
  [[nodiscard]] const std::vector<FieldDescription>& also() const { return selection_->also; }

  [[nodiscard]] bool by_field() const { return by_field_; }

  /// @param field  the fitted or given field, see Estimate::field.
  /// @return the field of a reading in the sensor's frame.
  [[nodiscard]] Eigen::Vector3d field_in_sensor(const Reading& reading,
                                                const TableField& field) const;

 private:
  // The readings that are used, and their weights. The selection does not depend on the model;
  // copies of the source share it.
  struct Selection {
    Eigen::MatrixXd weights;
    Eigen::RowVectorXd mean_variance;  // m: mean of 1 / weight over `rows`
    std::vector<std::size_t> rows;
    std::vector<std::size_t> rows_kept_out;
    std::vector<FieldDescription> also;
    // identifiers of the used blocks if the table's tilt is fitted for each block; otherwise empty
    std::vector<int> blocks;
    AxisMask in_range;
    std::optional<double> mean_time_s;
  };

  [[nodiscard]] Selection selected(Weighting weighting) const;
  [[nodiscard]] std::vector<TemperatureSpan> spans_of_sensors() const;
  void put_readings(const std::vector<std::size_t>& rows, ReadingSet& set) const;
  // Returns the weight of an observation before normalisation. It includes the effect of
  // variance_floor.
  [[nodiscard]] double weight(Eigen::Index row, Eigen::Index axis) const;
  void put_temperature(ReadingSet& set) const;

  const Experiment* experiment_;
  const Observations* observations_;
  bool by_field_;
  std::shared_ptr<const Selection> selection_;
  ModelChoice choice_;
  // temperature spans: one for all axes, or one for the temperature sensor of each axis
  std::vector<TemperatureSpan> spans_;
};

}  // namespace axiscal
