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

/// The readings of a run with the other contents of their files: for one instrument, for the slots
/// of an assembly, or for many units one after another. A run is one file, or several joined.
struct Run {
  Observations observations;
  std::vector<InputFileDigest> inputs;  ///< the files; empty for arrays
  /// The number of readings from each file, one file after another; empty if unknown.
  std::vector<std::size_t> rows_of_inputs;
  std::vector<std::string> notes;
  std::vector<std::string> axes;     ///< the response columns' names; of an assembly one slot's
  std::string field_unit;            ///< unit of the known fields, if a column's name states it
  std::string serial;                ///< the unit under test, from the first reading that states it
  std::vector<std::string> serials;  ///< every reading's; empty without such a column
  std::vector<std::string> dates;    ///< column `date` of every reading; empty without one
  std::vector<std::string> operators;  ///< column `operator` of every reading; empty without one
  std::string measured;                ///< stated date of the readings; else see measured_at()
  /// Where the columns are SLOT.axis: the slots in the columns' order; the responses are those of
  /// the first slot's axes, then the second's, ...
  std::vector<std::string> slots;
  /// The axes of each slot where they are not the same in all; else empty.
  std::vector<std::vector<std::string>> axes_of_slots;
  std::vector<std::string> ignored_columns;  ///< columns that nothing was done with
};

/// The columns of one instrument among several, each with SLOT. before it.
struct SlotColumns {
  std::string slot;
  std::vector<std::string> axes;
};

/// When a run was measured: as stated; else the last time in the column `time` if its times are
/// dates, or the last date in the column `date`.
/// @return ISO 8601, UTC; empty if unknown.
[[nodiscard]] AXISCAL_EXPORT std::string measured_at(const Run& run);

/// @return the names in the column `operator`, each once: "A. Smith, B. Jones"; empty without one.
[[nodiscard]] AXISCAL_EXPORT std::string operators_of(const Run& run);

/// Which columns a table of observations must have.
struct ObservationColumns {
  /// The response columns; where the first is missing, SLOT.axis of one slot or more.
  std::vector<std::string> axes = {"x", "y", "z"};
  std::vector<SlotColumns> slots;             ///< stated; `axes` then counts for nothing
  FaceNames face_names;                       ///< words that stand for faces
  std::vector<DifferentialAxis> differences;  ///< axes that are the difference of two columns
  std::optional<ReadingRange> range;          ///< each of their columns'
  bool needs_labels = false;                  ///< `rest` and `fence`, even where the field is given
  bool needs_samples = false;                 ///< `samples`
  bool needs_temperature = false;             ///< `temperature`
  bool takes_several_units = false;           ///< else a second `serial` is an error
  bool needs_sd = false;                      ///< `AXIS_sd` for each axis, positive
};

/// Reads a run from a file (formats.md, Observations).
///
/// @param path     CSV; `-` is standard input.
/// @param columns  the required columns. If x, y, z are requested and all three are absent, every
///                 column without another meaning is an axis.
/// @throws DataError  as read_observations().
[[nodiscard]] AXISCAL_EXPORT Run read_run(const std::string& path,
                                          const ObservationColumns& columns = {});

/// A run from arrays, as from a program's own acquisition.
///
/// @param points    how the cube lay in each reading; n.
/// @param response  the readings, n x m [unit of the instrument].
/// @throws DomainError  if their numbers differ.
[[nodiscard]] AXISCAL_EXPORT Run make_run(std::span<const DesignPoint> points,
                                          const Eigen::Ref<const Eigen::MatrixXd>& response);

/// The number of units under test in the readings: one, or several.
enum class Units { one, several };

/// @return the columns that an experiment's files need.
[[nodiscard]] AXISCAL_EXPORT ObservationColumns observation_columns(const Experiment& experiment,
                                                                    Units units);

/// Joins the files of a run, one or more; several are blocks.
///
/// @throws DataError  if they are of other slots, or `serial` is missing from one where the others
///                    are of several units, or is not the same where only one unit is taken.
[[nodiscard]] AXISCAL_EXPORT Run join_runs(std::vector<Run> files, Units units);

/// @return true if the readings are from more than one unit under test.
[[nodiscard]] AXISCAL_EXPORT bool has_several_units(const Run& run);

/// The units of a run in the order in which they first come; without a column `serial` all readings
/// are of one unit, of the serial that was stated. Each is made when it is asked for: thousands
/// take no more memory than their run.
class AXISCAL_EXPORT UnitsOfRun {
 public:
  UnitsOfRun(Run run, const std::string& stated_serial);

  [[nodiscard]] std::size_t size() const { return serials_.size(); }
  [[nodiscard]] const std::string& serial(std::size_t unit) const { return serials_[unit]; }
  [[nodiscard]] Run operator[](std::size_t unit) const;

  /// @return the number of readings of a unit.
  [[nodiscard]] std::size_t readings(std::size_t unit) const;

  /// @return the most frequent number of readings of a unit; the larger one of two equally frequent
  ///         numbers.
  [[nodiscard]] std::size_t usual_readings() const;

 private:
  Run run_;  // the serials of its readings are in the following lists
  std::vector<std::string> serials_;
  std::vector<std::size_t> rows_;    // of all units, one after another; empty without a column
  std::vector<std::size_t> begins_;  // the first index of each unit in those, and the end
};

/// @return all of them at once.
[[nodiscard]] AXISCAL_EXPORT std::vector<Run> split_by_serial(const Run& run,
                                                              const std::string& stated_serial);

}  // namespace axiscal
