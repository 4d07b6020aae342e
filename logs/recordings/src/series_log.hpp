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

/// A column of a table that is made of series.
struct MergedColumn {
  std::string name;
  std::size_t series = 0;  ///< number of its series in the recording
  std::size_t place = 0;   ///< position of the column in its series
};

/// A table made of series of a recording. The rows are the samples of one series, and the other
/// series are interpolated to their times. The memory is constant if the file interleaves the
/// series.
class SeriesLog final : public LogFile::Source {
 public:
  /// @param base     number of the series whose samples are the rows.
  /// @param columns  columns of the table after the time.
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
  bool has_begun_ = false;  // true after the first row with all series
  double first_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace axiscal
