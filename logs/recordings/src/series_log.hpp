// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "axiscal/logs/recorded_sensor.hpp"
#include "logs/recordings/src/log_source.hpp"
#include "logs/recordings/src/series_decoder.hpp"

namespace axiscal {

/// A column of a table of series.
struct MergedColumn {
  std::string name;
  std::size_t series = 0;  ///< number of it in the recording
  std::size_t place = 0;   ///< of the column in its series
};

/// Series of a recording as one table. The rows are at the samples of one series; the others are
/// interpolated to these times. The memory is constant if the file interleaves the series.
class SeriesLog final : public LogFile::Source {
 public:
  /// @param base     number of the series whose samples are the rows.
  /// @param columns  of the table, behind the time.
  SeriesLog(DecoderPointer decoder, std::size_t base, std::vector<MergedColumn> columns);
  ~SeriesLog() override;

  void select(const std::vector<std::size_t>& columns) override;
  std::size_t read(LogBlock& block, std::size_t most) override;

 private:
  class Sink;
  bool take_row(std::vector<double>& row);

  DecoderPointer decoder_;
  std::unique_ptr<Sink> sink_;
  std::size_t base_;
  std::vector<MergedColumn> merged_;
  std::vector<std::size_t> selected_;
  bool at_end_ = false;
  bool has_begun_ = false;  // true if all series are present
  double first_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace axiscal
