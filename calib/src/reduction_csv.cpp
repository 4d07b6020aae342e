// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reduction_csv.hpp"

#include <cmath>
#include <cstring>

#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/units.hpp"

namespace axiscal {
namespace {

// Text that is handed over in large blocks.
class BlockWriter {
 public:
  explicit BlockWriter(const std::function<void(std::string_view)>& sink)
      : sink_(sink), buffer_(1U << 18U) {}

  void put(char c) {
    reserve(1);
    buffer_[used_++] = c;
  }

  void put(std::string_view text) {
    reserve(text.size());
    std::memcpy(buffer_.data() + used_, text.data(), text.size());
    used_ += text.size();
  }

  // A comma and the number; NaN is an empty cell.
  void put_cell(double number) {
    reserve(number_text_size + 1);
    buffer_[used_++] = ',';
    if (!std::isnan(number)) {
      used_ =
          static_cast<std::size_t>(write_number(buffer_.data() + used_, number) - buffer_.data());
    }
  }

  void hand_over() {
    if (used_ > 0) {
      sink_({buffer_.data(), used_});
      used_ = 0;
    }
  }

 private:
  void reserve(std::size_t size) {
    if (used_ + size > buffer_.size()) {
      hand_over();
      if (size > buffer_.size()) {
        buffer_.resize(size);
      }
    }
  }

  const std::function<void(std::string_view)>& sink_;
  std::vector<char> buffer_;
  std::size_t used_ = 0;
};

std::vector<std::string> result_names(const std::vector<std::string>& axes,
                                      const Reducer& reducer) {
  std::vector<std::string> names;
  if (reducer.gives_components()) {
    names = {"field_x", "field_y", "field_z", "residual"};
    const auto& derived = reducer.kind().derived_names;
    names.insert(names.end(), derived.begin(), derived.end());
  } else {
    for (const std::string& axis : axes) {
      names.push_back("component_" + axis);
    }
    if (reducer.kind().has_axis_elevation) {
      for (const std::string& axis : axes) {
        names.push_back("angle_" + axis + "_deg");
      }
    }
  }
  names.emplace_back("flag");
  return names;
}

class CsvReduction {
 public:
  CsvReduction(CsvReader& csv,
               const std::vector<std::string>& axes,
               const Reducer& reducer,
               const ReductionCsvOptions& options,
               const std::function<void(std::string_view)>& sink)
      : csv_(csv),
        reducer_(reducer),
        options_(options),
        out_(sink),
        results_(result_names(axes, reducer)),
        readings_(axes.size()) {
    for (const std::string& axis : axes) {
      const std::optional<std::size_t> column = csv.column(axis);
      if (!column) {
        throw DataError(
            csv.path(), csv.line(),
            "column '" + axis + "': is missing; the columns are: " + joined(csv.header()));
      }
      columns_.push_back(*column);
    }
    for (const std::string& name : results_) {
      if (csv.column(name)) {
        throw DataError(csv.path(), csv.line(),
                        "column '" + name +
                            "': is there already, and apply would write it a second time; "
                            "rename or remove it");
      }
    }
  }

  ReductionCsvSummary run() {
    out_.put(csv_.header_text());
    for (const std::string& name : results_) {
      out_.put(',');
      out_.put(csv_cell(name));
    }
    end_row();
    for (CsvReader::Row row = csv_.next(); row != CsvReader::Row::end; row = csv_.next()) {
      ++summary_.rows;
      if (row == CsvReader::Row::defective) {
        refuse(csv_.defect());
        put_defective_row();
        put_unreadable();
      } else {
        out_.put(csv_.text());
        reduce_row();
      }
      end_row();
    }
    out_.hand_over();
    return summary_;
  }

 private:
  void end_row() {
    out_.put('\n');
    if (options_.every_row) {
      out_.hand_over();
    }
  }

  // Own cells as they are; short rows are filled up, so that results stand in their columns, and
  // stray quotes are made whole, so that the next reader does not stumble.
  void put_defective_row() {
    if (csv_.text().find('"') == std::string_view::npos) {
      out_.put(csv_.text());
    } else {
      bool first = true;
      for (const std::string_view cell : csv_.cells()) {
        if (!first) {
          out_.put(',');
        }
        first = false;
        out_.put(csv_cell(std::string(cell)));
      }
    }
    for (std::size_t i = csv_.cell_count(); i < csv_.header().size(); ++i) {
      out_.put(',');
    }
  }

  void put_unreadable() {
    ++summary_.unreadable;
    if (summary_.first_unreadable_line == 0) {
      summary_.first_unreadable_line = csv_.line();
    }
    for (std::size_t i = 0; i < results_.size(); ++i) {
      out_.put(',');
    }
    out_.put("unreadable");
  }

  void refuse(std::string_view what) const {
    if (options_.strict) {
      throw DataError(csv_.path(), csv_.line(), what);
    }
  }

  void reduce_row() {
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const std::optional<double> reading = parse_number(csv_.cells()[columns_[k]]);
      if (!reading) {
        if (options_.strict) {
          refuse("column '" + csv_.header()[columns_[k]] + "': '" +
                 std::string(csv_.cells()[columns_[k]].substr(0, 40)) + "' is not a finite number");
        }
        put_unreadable();
        return;
      }
      readings_[k] = *reading;
    }
    if (reducer_.gives_components()) {
      put_components();
    } else {
      put_axes();
    }
  }

  void put_components() {
    const ReducedReading reduced = reducer_.reduce(readings_);
    if (!std::isfinite(reduced.residual)) {
      refuse("the readings are too large to be reduced");
      put_unreadable();
      return;
    }
    for (const double component : reduced.field_in_sensor) {
      out_.put_cell(component);
    }
    out_.put_cell(reduced.residual);
    for (std::size_t i = 0; i < reducer_.kind().derived_names.size(); ++i) {
      out_.put_cell(reduced.derived.values[i]);
    }
    put_flag(reduced.derived.clamped);
  }

  void put_axes() {
    bool clamped = false;
    for (std::size_t k = 0; k < readings_.size(); ++k) {
      if (!std::isfinite(reducer_.reduce_axis(k, readings_[k]).component)) {
        refuse("the readings are too large to be reduced");
        put_unreadable();
        return;
      }
    }
    for (std::size_t k = 0; k < readings_.size(); ++k) {
      out_.put_cell(reducer_.reduce_axis(k, readings_[k]).component);
    }
    if (reducer_.kind().has_axis_elevation) {
      for (std::size_t k = 0; k < readings_.size(); ++k) {
        const ReducedAxis reduced = reducer_.reduce_axis(k, readings_[k]);
        out_.put_cell(reduced.angle_rad * deg_per_rad);
        clamped = clamped || reduced.clamped;
      }
    }
    put_flag(clamped);
  }

  void put_flag(bool clamped) {
    out_.put(clamped ? ",clamped" : ",");
    summary_.clamped += clamped ? 1 : 0;
  }

  CsvReader& csv_;
  const Reducer& reducer_;
  const ReductionCsvOptions& options_;
  BlockWriter out_;
  std::vector<std::string> results_;
  std::vector<std::size_t> columns_;
  std::vector<double> readings_;
  ReductionCsvSummary summary_;
};

}  // namespace

ReductionCsvSummary reduce_csv(CsvReader& csv,
                               const std::vector<std::string>& axes,
                               const Reducer& reducer,
                               const ReductionCsvOptions& options,
                               const std::function<void(std::string_view)>& sink) {
  return CsvReduction(csv, axes, reducer, options, sink).run();
}

}  // namespace axiscal
