// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axiscal/calib/reading_uncertainty.hpp"
#include "axiscal/calib/reduction.hpp"
#include "axiscal/core/csv_reader.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// The reading of an axis in a table: one column, or the difference of two columns.
struct ReadingColumn {
  std::string axis;
  std::string plus;   ///< name of the column with the reading
  std::string minus;  ///< name of the column to subtract; empty if there is no such column
};

/// @return the columns of an instrument's axes.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReadingColumn> reading_columns(
    const Instrument& instrument);

/// @return the columns of a record's axes in a table. The columns have the names of the axes, or
///         SLOT.axis if the table contains the whole assembly.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReadingColumn> columns_in(const CsvReader& csv,
                                                                   const Calibration& calibration);

/// The indices of a record's temperature columns in a table: one index, or one for each axis. The
/// list is empty if the record has no temperature terms.
using TemperaturePlaces = std::vector<std::size_t>;

/// Finds the temperature columns of a record.
/// @param axes    the columns of the readings.
/// @param column  name of the column if there is one temperature sensor. If a column with this name
///                and the prefix SLOT. exists, it is used instead. If each axis has its own sensor,
///                the columns are AXIS_temperature or temperature_AXIS.
/// @throws DataError  if a column is missing.
[[nodiscard]] AXISCAL_EXPORT TemperaturePlaces
temperature_places(const CsvReader& csv,
                   const std::vector<ReadingColumn>& axes,
                   const SensorModel& sensor,
                   const std::string& column = "temperature");

/// A second instrument on the other side of a mechanical joint of the same model. Its readings are
/// in the same rows as those of the first instrument.
struct JointColumns {
  const Reducer* reducer = nullptr;  ///< reducer of the second instrument, in the model's axes
  std::vector<ReadingColumn> columns;
  /// `uncertainty` is the uncertainty propagation of the second instrument, and `own_uncertainty`
  /// that of the first, in the model's axes. Each is null if the instrument's record states no
  /// covariance.
  const ReadingPropagation* uncertainty = nullptr;
  const ReadingPropagation* own_uncertainty = nullptr;
  double degrees_of_freedom = 0.0;  ///< degrees of freedom of the sum of both covariances
  /// An angle above alarm_rad is flagged `moved` if it is significant (p < 0.001). If significance
  /// cannot be tested, every angle above alarm_rad is flagged, unless alarm_rad is 0.
  double alarm_rad = 0.0;
};

/// How reduced readings are written.
enum class ReductionForm {
  csv,  ///< the table's cells, followed by the results
  npy,  ///< only results, in NumPy's binary format: 8 bytes for each number, 1 byte for the flag
};

struct ReductionCsvOptions {
  ReductionForm form = ReductionForm::csv;
  /// The reducer of an accelerometer, whose readings are needed for headings and for records with a
  /// second field (option --also); may be null.
  const Reducer* attitude = nullptr;
  std::vector<ReadingColumn> attitude_columns;
  /// Column of the sensor's temperature, for records with temperature terms. If each axis has a
  /// separate sensor, the column is AXIS_temperature or temperature_AXIS.
  std::string temperature_column = "temperature";
  /// The uncertainty propagation of the results, and that of `attitude`. If `uncertainty` is null,
  /// no uncertainties are written.
  const ReadingPropagation* uncertainty = nullptr;
  const ReadingPropagation* attitude_uncertainty = nullptr;
  /// Second instrument; adds the columns `joint_deg` and `u_joint_deg`.
  std::optional<JointColumns> joint;
  /// Also writes expanded uncertainties and coverage factors, if `uncertainty` is set.
  bool expanded = false;
  bool strict = false;  ///< if true, a row that cannot be reduced is an error
  /// Number of decimals of every result, 0 to 15. If it is nullopt, the shortest text that gives
  /// the exact number is written.
  std::optional<int> decimals;
  /// True if the sink gets each row as soon as it is reduced; false if it gets large blocks of
  /// rows.
  bool every_row = false;
};

/// The bits of the flag in binary rows.
namespace reduction_flag {
constexpr unsigned clamped = 1;
constexpr unsigned extrapolated = 2;
constexpr unsigned moved = 4;
constexpr unsigned saturated = 8;
constexpr unsigned unreadable = 16;
}  // namespace reduction_flag

struct ReductionCsvSummary {
  std::size_t rows = 0;
  std::size_t unreadable = 0;  ///< rows that could not be reduced
  /// Line of the first row that could not be reduced; 0 if all rows were reduced.
  std::size_t first_unreadable_line = 0;
  /// Rows with a component larger than the field's magnitude.
  std::size_t clamped = 0;
  std::size_t far_from_field = 0;  ///< rows whose |f_hat| differs from F by more than 30 %
  std::size_t extrapolated = 0;    ///< rows at temperatures outside the calibrated range
  std::size_t saturated = 0;       ///< rows with a reading at or beyond the range of its axis
  std::size_t moved = 0;           ///< rows with the flag `moved`, see JointColumns::alarm_rad
};

/// Reduces a table row by row on several cores (formats.md, Reduced readings). The memory use does
/// not depend on the length of the table. The output does not depend on the number of cores.
///
/// Each row's cells are copied, and the results are appended. If a spreadsheet would read a cell as
/// a formula, an apostrophe is written in front of it. The results are `field_x`, `field_y`,
/// `field_z`, `residual`, the derived values of the kind of instrument, and `flag`. If the
/// instrument has fewer than three axes, the results are `component_AXIS` for each axis,
/// `angle_AXIS_deg` if the kind of instrument has angles, and `flag`. A row that cannot be reduced
/// is also written, with empty results and the flag `unreadable` or `saturated`. If `uncertainty`
/// is set, the standard uncertainties follow in columns with the prefix u_. If `expanded` is true,
/// the expanded uncertainties (U_) and the coverage factors (k_) follow too.
///
/// @param csv      the readings, positioned after their header.
/// @param axes     the columns to reduce, in the reducer's order.
/// @param reducer  the reducer for these axes.
/// @param sink     receives the output, block by block.
/// @throws DataError  if a column is missing, if the table already has a column of the results, or,
///                    with `strict`, for the first row that cannot be reduced.
AXISCAL_EXPORT ReductionCsvSummary reduce_csv(CsvReader& csv,
                                              const std::vector<ReadingColumn>& axes,
                                              const Reducer& reducer,
                                              const ReductionCsvOptions& options,
                                              const std::function<void(std::string_view)>& sink);

/// Returns the header of a NumPy file, which precedes the binary rows and contains the names of the
/// columns. Its length does not depend on the number of rows.
[[nodiscard]] AXISCAL_EXPORT std::string reduction_npy_header(
    const std::vector<ReadingColumn>& axes,
    const Reducer& reducer,
    const ReductionCsvOptions& options,
    std::size_t rows);

}  // namespace axiscal
