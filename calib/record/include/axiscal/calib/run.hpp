// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/experiment.hpp"
#include "axiscal/calib/face_names.hpp"
#include "axiscal/calib/observations.hpp"
#include "axiscal/core/eigen_alignment.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The readings of a run and the other contents of its files. The readings are from one instrument,
/// from the instruments in the slots of an assembly, or from many units one after another. A run is
/// one file or several joined files.
struct Run {
  Observations observations;
  std::vector<InputFileDigest> inputs;  ///< the files; empty if the run was made from arrays
  /// Number of readings from each file, in the order of `inputs`; empty if unknown.
  std::vector<std::size_t> rows_of_inputs;
  std::vector<std::string> notes;
  std::vector<std::string>
      axes;  ///< names of the axes; for an assembly, the names of the axes of a single slot
  std::string field_unit;              ///< unit of the known fields, if a column's name states it
  std::string serial;                  ///< serial number of the unit, or of the first unit
  std::vector<std::string> serials;    ///< serial number of each reading; empty if not stated
  std::vector<std::string> dates;      ///< date of each reading; empty if not stated
  std::vector<std::string> operators;  ///< operator of each reading; empty if not stated
  std::string measured;                ///< stated date of the readings; empty if not stated
  /// Names of the slots, in the order of their columns SLOT.axis; empty without such columns. The
  /// responses are in the same order, one slot after another.
  std::vector<std::string> slots;
  /// The axes of each slot; empty if all slots have the same axes.
  std::vector<std::vector<std::string>> axes_of_slots;
  std::vector<std::string> ignored_columns;  ///< names of the columns that were not used
};

/// The response columns SLOT.axis of one instrument in an assembly.
struct SlotColumns {
  std::string slot;
  std::vector<std::string> axes;
};

/// Returns the date of a run: the stated date, if there is one. Otherwise, if the times in the
/// column `time` include dates, returns the last time. If they do not, returns the last date in the
/// column `date`.
/// @return ISO 8601, UTC; empty if unknown.
[[nodiscard]] AXISCAL_EXPORT std::string measured_at(const Run& run);

/// @return the distinct names in the column `operator`, for example "A. Smith, B. Jones"; empty
///         without that column.
[[nodiscard]] AXISCAL_EXPORT std::string operators_of(const Run& run);

/// The columns that a table of observations must have.
struct ObservationColumns {
  /// The response columns. If the first of these columns is missing, the columns SLOT.axis of an
  /// assembly are read instead.
  std::vector<std::string> axes = {"x", "y", "z"};
  std::vector<SlotColumns> slots;             ///< stated slots; if not empty, `axes` is ignored
  FaceNames face_names;                       ///< words that stand for faces
  std::vector<DifferentialAxis> differences;  ///< axes that are the difference of two columns
  std::optional<ReadingRange> range;          ///< range of the two columns of a differential axis
  /// True: the columns `rest` and `fence` are required, even if the table states the fields.
  bool needs_labels = false;
  bool needs_samples = false;        ///< true: the column `samples` is required
  bool needs_temperature = false;    ///< true: the column `temperature` is required
  bool takes_several_units = false;  ///< false: different serial numbers are an error
  bool needs_sd = false;             ///< true: each axis requires a positive `AXIS_sd`
};

/// Reads a run from a file (formats.md, Observations).
///
/// @param path     CSV; `-` is standard input.
/// @param columns  the required columns. If x, y, z are requested and all three are absent, every
///                 column without another meaning is an axis.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT Run read_run(const std::string& path,
                                          const ObservationColumns& columns = {});

/// Makes a run from arrays, for example from a program's own acquisition.
///
/// @param points    the design point of each reading, n entries.
/// @param response  the readings, n x m [unit of the instrument].
/// @throws DomainError  if the number of points differs from the number of rows.
[[nodiscard]] AXISCAL_EXPORT Run make_run(std::span<const DesignPoint> points,
                                          const Eigen::Ref<const Eigen::MatrixXd>& response);

/// The number of units under test in the readings: one, or several.
enum class Units { one, several };

/// @return the columns that the readings of an experiment must have.
[[nodiscard]] AXISCAL_EXPORT ObservationColumns observation_columns(const Experiment& experiment,
                                                                    Units units);

/// Joins the files of a run. Each file becomes one or more blocks.
///
/// @throws DataError  if the files have different slots, if a file lacks the column `serial` while
///                    the other files contain several units, or if `units` is `one` and the serial
///                    numbers differ.
[[nodiscard]] AXISCAL_EXPORT Run join_runs(std::vector<Run> files, Units units);

/// @return true if the readings are from more than one unit under test.
[[nodiscard]] AXISCAL_EXPORT bool has_several_units(const Run& run);

/// The units of a run in the order of their first readings. Without a column `serial`, all readings
/// are of one unit with the stated serial number. operator[] makes the run of a unit on demand, so
/// even thousands of units need no more memory than the whole run.
class AXISCAL_EXPORT UnitsOfRun {
 public:
  UnitsOfRun(Run run, const std::string& stated_serial);

  [[nodiscard]] std::size_t size() const { return serials_.size(); }
  [[nodiscard]] const std::string& serial(std::size_t unit) const { return serials_[unit]; }
  [[nodiscard]] Run operator[](std::size_t unit) const;

  /// @return the number of readings of a unit.
  [[nodiscard]] std::size_t readings(std::size_t unit) const;

  /// @return the most frequent number of readings of a unit. If several numbers are equally
  ///         frequent, the largest of them.
  [[nodiscard]] std::size_t usual_readings() const;

 private:
  Run run_;  // the run without its list `serials`, which the members below replace
  std::vector<std::string> serials_;
  std::vector<std::size_t> rows_;  // row numbers, sorted by unit; empty without `serial`
  // For each unit, the index of its first row in rows_; the last entry is the size of rows_.
  std::vector<std::size_t> begins_;
};

/// @return one run for each unit, in the order of UnitsOfRun.
[[nodiscard]] AXISCAL_EXPORT std::vector<Run> split_by_serial(const Run& run,
                                                              const std::string& stated_serial);

}  // namespace axiscal
