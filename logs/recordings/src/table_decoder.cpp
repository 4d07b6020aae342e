// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/logs/sensor_names.hpp"
#include "axiscal/logs/time_column.hpp"
#include "core/formatted.hpp"
#include "logs/recordings/src/opened.hpp"
#include "logs/recordings/src/sensor_data.hpp"

namespace axiscal {
namespace {

constexpr std::size_t block_rows = 8192;
constexpr std::size_t most_values = std::size_t{1} << 20U;  // 8 MiB of doubles

class TableDecoder final : public RecordingFile::Decoder {
 public:
  explicit TableDecoder(OpenedFile opened)
      : source_(std::move(opened.table)), name_(std::move(opened.table_name)) {
    format = std::move(opened.format);
    for (std::size_t c = 0; c < source_->columns.size(); ++c) {
      if (std::find(source_->is_text.begin(), source_->is_text.end(), c) ==
          source_->is_text.end()) {
        places_.push_back(c);
        columns_.push_back(source_->columns[c]);
      } else {
        facts["text columns"] += (facts["text columns"].empty() ? "" : ",") + source_->columns[c];
      }
    }
    source_->select(places_);
  }

  bool read(SeriesSink& sink) override {
    // A line of text may have tens of thousands of cells, so the number of values of a block is
    // limited.
    const std::size_t most = std::clamp<std::size_t>(
        most_values / std::max<std::size_t>(1, places_.size()), 1, block_rows);
    const std::size_t rows = source_->read(block_, most);
    if (rows == 0) {
      return false;
    }
    if (!series_.announced()) {
      begin(sink);
    }
    std::vector<double> row(others_.size());
    for (std::size_t r = 0; r < rows; ++r) {
      for (std::size_t c = 0; c < others_.size(); ++c) {
        row[c] = block_[others_[c]][r];
      }
      series_.put(sink, time_of(r), row);
      ++done_;
    }
    return true;
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> all = notes_;
    all.insert(all.end(), source_->notes.begin(), source_->notes.end());
    const LogDefects& defects = source_->defects;
    if (defects.ragged_rows > 0) {
      all.push_back(
          formatted("{} rows are left out, because their number of cells differs from that of the "
                    "first row (the first row left out is line {})",
                    defects.ragged_rows, defects.first_ragged_line));
    }
    return all;
  }

 private:
  [[nodiscard]] double time_of(std::size_t row) {
    if (time_ && is_counter_) {  // the 16-bit counter starts again from 0 after 65535
      constexpr double turn = 65536.0;
      const double count = block_[*time_][row];
      turns_ += count + 0.5 * turn < last_count_ ? turn : 0.0;
      last_count_ = count;
      return (count + turns_) * seconds_;
    }
    if (time_) {
      return block_[*time_][row] * seconds_;
    }
    return source_->rate_hz > 0.0 ? static_cast<double>(done_) / source_->rate_hz : not_a_number;
  }

  // Recognises the columns from the first block, and announces their series.
  void begin(SeriesSink& sink) {
    TableColumns columns = recognise_columns(columns_, name_, block_);
    time_ = columns.time;
    for (std::size_t c = 0; !time_ && c < places_.size(); ++c) {
      if (source_->clock == places_[c]) {
        time_ = c;
        columns.seconds = 1.0;
      }
    }
    const auto counter = std::find(columns_.begin(), columns_.end(), "PacketCounter");
    if (!time_ && source_->rate_hz > 0.0 && counter != columns_.end()) {
      time_ = static_cast<std::size_t>(counter - columns_.begin());
      seconds_ = 1.0 / source_->rate_hz;
      is_counter_ = true;
    } else if (time_) {
      const TimeColumn column{.position = *time_,
                              .seconds = columns.seconds > 0.0 ? columns.seconds : 1.0,
                              .unit_is_stated = columns.seconds > 0.0,
                              .name = columns_[*time_]};
      try {
        const TimeUnit unit = settle_time_unit(name_, column, block_[*time_]);
        seconds_ = unit.seconds;
        if (!unit.remark.empty()) {
          notes_.push_back(unit.remark);
        }
      } catch (const DataError& error) {
        notes_.emplace_back(error.what());
        seconds_ = not_a_number;
      }
    }
    std::vector<std::string> names;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      if (time_ != c) {
        others_.push_back(c);
        names.push_back(columns_[c]);
      }
    }
    std::vector<Series> of_columns;
    for (const std::size_t column : others_) {
      of_columns.push_back(columns.series[column]);
    }
    series_ = MessageSeries(name_, 0, names, of_columns);
    series_.announce(sink, count_);
  }

  std::unique_ptr<LogFile::Source> source_;
  std::string name_;
  std::vector<std::size_t> places_;  // indices of the columns that contain numbers
  std::vector<std::string> columns_;
  LogBlock block_;
  std::optional<std::size_t> time_;
  double seconds_ = 1.0;
  bool is_counter_ = false;  // true if the column `time_` counts samples
  double last_count_ = 0.0, turns_ = 0.0;
  std::size_t done_ = 0;
  std::vector<std::size_t> others_;
  MessageSeries series_;
  std::size_t count_ = 0;
};

}  // namespace

DecoderPointer decoder_of_table(OpenedFile opened) {
  return std::make_unique<TableDecoder>(std::move(opened));
}

}  // namespace axiscal
