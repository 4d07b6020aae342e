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

/// Where the reading of an axis is: a column, or the difference of two.
struct ReadingColumn {
  std::string axis;
  std::string plus;   ///< name of the column
  std::string minus;  ///< the column to be subtracted; empty for none
};

/// @return the columns of an instrument's axes.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReadingColumn> reading_columns(
    const Instrument& instrument);

/// @return the columns of a record's axes in a table: their names, or SLOT.axis in a table of its
///         whole assembly.
[[nodiscard]] AXISCAL_EXPORT std::vector<ReadingColumn> columns_in(const CsvReader& csv,
                                                                   const Calibration& calibration);

/// Where a table has what the temperature sensors of a record say: none without temperature terms,
/// one, or one for each axis.
using TemperaturePlaces = std::vector<std::size_t>;

/// @param axes    where the readings are.
/// @param column  of a single sensor; for a slot, SLOT.column if it exists. Axes with separate
///                sensors have AXIS_temperature or temperature_AXIS.
/// @throws DataError  where one is missing.
[[nodiscard]] AXISCAL_EXPORT TemperaturePlaces
temperature_places(const CsvReader& csv,
                   const std::vector<ReadingColumn>& axes,
                   const SensorModel& sensor,
                   const std::string& column = "temperature");

/// A second instrument in the same rows, on the other side of a mechanical joint of one model.
struct JointColumns {
  const Reducer* reducer = nullptr;  ///< in the model's axes
  std::vector<ReadingColumn> columns;
  /// Of the two instruments, in the model's axes; null where a record states no covariance.
  const ReadingPropagation* uncertainty = nullptr;
  const ReadingPropagation* own_uncertainty = nullptr;
  double degrees_of_freedom = 0.0;  ///< of the scatter that these rest on
  /// A larger angle that is significant (p < 0.001) is flagged `moved`. If the test is impossible,
  /// every larger angle is flagged, unless alarm_rad is 0.
  double alarm_rad = 0.0;
};

/// How reduced readings are written.
enum class ReductionForm {
  csv,  ///< the table's cells with the results behind them
  npy,  ///< the results alone, as rows of NumPy's binary format: 8 bytes each, 1 for the flag
};

struct ReductionCsvOptions {
  ReductionForm form = ReductionForm::csv;
  /// An accelerometer's, for headings and second fields; null without one.
  const Reducer* attitude = nullptr;
  std::vector<ReadingColumn> attitude_columns;
  /// Column of the sensor's temperature, for records with temperature terms. If each axis has a
  /// separate sensor, the column is AXIS_temperature or temperature_AXIS.
  std::string temperature_column = "temperature";
  /// Gives the uncertainty of each result, and of `attitude`; null: omitted.
  const ReadingPropagation* uncertainty = nullptr;
  const ReadingPropagation* attitude_uncertainty = nullptr;
  std::optional<JointColumns> joint;  ///< adds `joint_deg`, with uncertainties `u_joint_deg`
  bool expanded = false;  ///< with `uncertainty`: the expanded one and its coverage factor too
  bool strict = false;    ///< a row that cannot be reduced is an error
  std::optional<int> decimals;  ///< of every result, 0 to 15; else as many as read back to it
  bool every_row = false;       ///< hand over each row at once instead of large blocks
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
  std::size_t unreadable = 0;             ///< rows that could not be reduced
  std::size_t first_unreadable_line = 0;  ///< 0 where there is none
  std::size_t clamped = 0;                ///< rows with a component larger than the field
  std::size_t far_from_field = 0;         ///< rows whose |f_hat| differs from F by more than 30 %
  std::size_t extrapolated = 0;           ///< rows at temperatures outside the calibrated range
  std::size_t saturated = 0;              ///< rows with a reading at or beyond its range
  std::size_t moved = 0;                  ///< rows in which a joint moved beyond the alarm
};

/// Reduces a table row by row (formats.md, Reduced readings), in constant memory, on all cores of
/// the machine. The output does not depend on the number of cores.
///
/// Each row's cells are copied unchanged, and the results are appended: `field_x,field_y,field_z,
/// residual`, the derived values of the kind of instrument, and `flag`. With fewer than three axes
/// these are `component_AXIS` for each axis, and `angle_AXIS_deg` if the kind has angles. A row
/// that cannot be reduced keeps its place, with empty results and the flag `unreadable` or
/// `saturated`. With `uncertainty`, the names follow again with the prefix u_; with `expanded`,
/// again with the prefixes U_ and k_.
///
/// @param csv      the readings, positioned behind their header.
/// @param axes     the columns to reduce, in the reducer's order.
/// @param reducer  for as many axes.
/// @param sink     takes the text, block by block.
/// @throws DataError  if a column is missing or the output would have one twice; with `strict` for
///                    the first row that cannot be reduced.
AXISCAL_EXPORT ReductionCsvSummary reduce_csv(CsvReader& csv,
                                              const std::vector<ReadingColumn>& axes,
                                              const Reducer& reducer,
                                              const ReductionCsvOptions& options,
                                              const std::function<void(std::string_view)>& sink);

/// The header before binary rows in a NumPy file: the names of the columns. Its length does not
/// depend on the number of rows.
[[nodiscard]] AXISCAL_EXPORT std::string reduction_npy_header(
    const std::vector<ReadingColumn>& axes,
    const Reducer& reducer,
    const ReductionCsvOptions& options,
    std::size_t rows);

}  // namespace axiscal
