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

/// A column of a table that is made from several series.
struct MergedColumn {
  std::string name;
  std::size_t series = 0;  ///< index of the series that contains the column
  std::size_t place = 0;   ///< index of the column in this series
};

/// A table made from the series of a recording. The rows are the samples of one series, and the
/// other series are interpolated to the times of these rows. If the series are interleaved in the
/// file, the memory use does not depend on the length of the recording.
class SeriesLog final : public LogFile::Source {
 public:
  /// @param base     index of the series whose samples are the rows.
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
  bool has_begun_ = false;  // true after the first complete row, at the latest after one second
  double first_s_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace axiscal
