// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/reduction_csv.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "axiscal/calib/body.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/parallel.hpp"
#include "axiscal/core/printable_text.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/worker_count.hpp"
#include "core/formatted.hpp"
#include "core/npy_header.hpp"

namespace axiscal {
namespace {

using Sink = std::function<void(std::string_view)>;

// Writes rows to a buffer. A full buffer is enlarged; or, if the buffer is already large and there
// is a sink, its rows are passed to the sink.
class RowWriter {
 public:
  // @param buffer  receives the output; its old content is discarded.
  // @param sink    receives the rows of a large, full buffer; if null, the buffer always grows.
  RowWriter(std::vector<char>& buffer,
            const Sink* sink,
            ReductionForm form,
            std::optional<int> decimals)
      : buffer_(buffer), sink_(sink), form_(form), decimals_(decimals) {
    constexpr std::size_t least = 1U << 13U;
    buffer_.resize(std::max(buffer_.size(), least));
  }

  // The rows that have not been passed to the sink.
  [[nodiscard]] std::string_view rows() const { return {buffer_.data(), used_}; }

  // Writes text if the output is CSV. Does nothing if it is binary.
  void put(std::string_view text) {
    if (form_ == ReductionForm::csv) {
      append(text);
    }
  }

  // Writes a comma and the number, or an empty cell for NaN. Binary output contains only the
  // number.
  void put_cell(double number) {
    reserve(number_text_size + 1);
    if (form_ == ReductionForm::npy) {
      std::memcpy(buffer_.data() + used_, &number, sizeof number);
      used_ += sizeof number;
      return;
    }
    buffer_[used_++] = ',';
    if (!std::isnan(number)) {
      char* const from = buffer_.data() + used_;
      char* const end =
          decimals_ ? write_decimals(from, number, *decimals_) : write_number(from, number);
      used_ = static_cast<std::size_t>(end - buffer_.data());
    }
  }

  // Writes a comma and the words for the bits of the flag. Binary output contains the flag's byte.
  void put_flag(unsigned flag) {
    if (form_ == ReductionForm::npy) {
      reserve(1);
      buffer_[used_++] = static_cast<char>(flag);
      return;
    }
    using namespace reduction_flag;
    constexpr std::array<std::pair<unsigned, std::string_view>, 5> words = {{
        {clamped, "clamped"},
        {extrapolated, "extrapolated"},
        {moved, "moved"},
        {saturated, "saturated"},
        {unreadable, "unreadable"},
    }};
    std::string_view before = ",";
    for (const auto& [bit, word] : words) {
      if ((flag & bit) != 0) {
        append(before);
        append(word);
        before = " ";
      }
    }
    append(flag == 0 ? before : "");
  }

  void hand_over() {
    if (used_ > 0) {
      (*sink_)({buffer_.data(), used_});
      used_ = 0;
    }
  }

 private:
  void append(std::string_view text) {
    reserve(text.size());
    std::memcpy(buffer_.data() + used_, text.data(), text.size());
    used_ += text.size();
  }

  void reserve(std::size_t size) {
    constexpr std::size_t large = 1U << 18U;
    if (used_ + size > buffer_.size()) {
      if (sink_ != nullptr && buffer_.size() >= large) {
        hand_over();
      }
      buffer_.resize(std::max(buffer_.size(), 2 * (used_ + size)));
    }
  }

  std::vector<char>& buffer_;
  const Sink* sink_;
  ReductionForm form_;
  std::optional<int> decimals_;
  std::size_t used_ = 0;
};

bool derives(const Reducer& reducer, const ReductionCsvOptions& options) {
  return options.attitude != nullptr || !reducer.kind().derives_with_attitude;
}

std::vector<std::string> result_names(const std::vector<ReadingColumn>& axes,
                                      const Reducer& reducer,
                                      const ReductionCsvOptions& options) {
  std::vector<std::string> names;
  if (reducer.gives_components()) {
    names = {"field_x", "field_y", "field_z", "residual"};
    const auto& derived = reducer.kind().derived_names;
    if (derives(reducer, options)) {
      names.insert(names.end(), derived.begin(), derived.end());
    }
  } else {
    for (const ReadingColumn& column : axes) {
      names.push_back("component_" + column.axis);
    }
    if (reducer.kind().has_axis_elevation) {
      for (const ReadingColumn& column : axes) {
        names.push_back(formatted("angle_{}_deg", column.axis));
      }
    }
    if (reducer.completes_third_component()) {
      names.insert(names.end(), reducer.kind().derived_names.begin(),
                   reducer.kind().derived_names.end());
    }
  }
  if (options.uncertainty != nullptr) {
    const std::size_t results = names.size();
    const std::vector<const char*> prefixes = options.expanded
                                                  ? std::vector<const char*>{"u_", "U_", "k_"}
                                                  : std::vector<const char*>{"u_"};
    for (const char* const prefix : prefixes) {
      for (std::size_t i = 0; i < results; ++i) {
        names.push_back(prefix + names[i]);
      }
    }
  }
  if (options.joint) {
    names.emplace_back("joint_deg");
    if (options.uncertainty != nullptr) {
      names.emplace_back("u_joint_deg");
    }
  }
  names.emplace_back("flag");
  return names;
}

// Finds the temperature column of each axis. It is AXIS_temperature or temperature_AXIS. If the
// axis is in a slot, it is SLOT.AXIS_temperature or SLOT.temperature_AXIS.
TemperaturePlaces own_temperatures(const CsvReader& csv, const std::vector<ReadingColumn>& axes) {
  TemperaturePlaces places;
  for (const ReadingColumn& column : axes) {
    const std::string& axis = column.axis;
    const std::size_t name = axis.rfind('.') + 1;  // start of the axis name; 0 without SLOT.
    const std::optional<std::size_t> turned =
        csv.column(axis.substr(0, name) + "temperature_" + axis.substr(name));
    places.push_back(turned ? *turned : csv.need(axis + "_temperature"));
  }
  return places;
}

// Finds the column of a temperature sensor that all axes share. In a table with slots, it is
// SLOT.column if that exists; otherwise it is `column`. If there is a single axis, AXIS_temperature
// is accepted too.
std::size_t one_temperature(const CsvReader& csv,
                            const std::vector<ReadingColumn>& axes,
                            const std::string& column) {
  const std::string& axis = axes.front().axis;
  std::optional<std::size_t> own = csv.column(axis.substr(0, axis.rfind('.') + 1) + column);
  if (!own && axes.size() == 1 && !csv.column(column)) {
    own = csv.column(axis + "_temperature");
  }
  return own ? *own : csv.need(column);
}

// Reads the readings of one instrument from the current row.
class RowReader {
 public:
  // @param temperature  name of the temperature column; used if the reducer needs one temperature
  //                     for all axes.
  RowReader(const CsvReader& csv,
            const std::vector<ReadingColumn>& axes,
            const Reducer& reducer,
            const std::string& temperature)
      : csv_(csv) {
    if (reducer.has_own_temperatures()) {
      temperature_places_ = own_temperatures(csv, axes);
    } else if (reducer.needs_temperature()) {
      temperature_places_ = {one_temperature(csv, axes, temperature)};
    }
    temperatures_.resize(temperature_places_.size());
    for (const ReadingColumn& axis : axes) {
      plus_.push_back(csv.need(axis.plus));
      minus_.push_back(axis.minus.empty() ? std::nullopt : std::optional(csv.need(axis.minus)));
    }
    readings_.resize(axes.size());
  }

  // Reads the row. Returns false if a cell is not a number; defect() then describes the cell.
  bool read(const Reducer& reducer) {
    saturated_ = false;
    for (std::size_t k = 0; k < plus_.size(); ++k) {
      const std::optional<double> plus = number(plus_[k], reducer);
      const std::optional<double> minus = minus_[k] ? number(*minus_[k], reducer) : 0.0;
      if (!plus || !minus) {
        return false;
      }
      readings_[k] = *plus - *minus;
    }
    for (std::size_t t = 0; t < temperature_places_.size(); ++t) {
      const std::optional<double> value = parse_number(csv_.cells()[temperature_places_[t]]);
      if (!value) {
        defective_ = temperature_places_[t];
        return false;
      }
      temperatures_[t] = *value;
    }
    if (temperatures_.size() == 1) {
      temperature_ = temperatures_.front();
    } else if (!temperatures_.empty()) {
      temperature_ = SensorTemperature(temperatures_);
    }
    return true;
  }

  [[nodiscard]] const std::vector<double>& readings() const { return readings_; }
  [[nodiscard]] const std::optional<SensorTemperature>& temperature() const { return temperature_; }
  [[nodiscard]] bool saturated() const { return saturated_; }
  [[nodiscard]] std::string defect() const {
    return formatted("column '{}': '{}' is not a finite number", csv_.header()[defective_],
                     csv_.cells()[defective_].substr(0, 40));
  }

 private:
  std::optional<double> number(std::size_t column, const Reducer& reducer) {
    const std::optional<double> value = parse_number(csv_.cells()[column]);
    if (!value) {
      defective_ = column;
    } else {
      saturated_ = saturated_ || reducer.is_saturated(*value);
    }
    return value;
  }

  const CsvReader& csv_;
  std::vector<std::size_t> plus_;
  std::vector<std::optional<std::size_t>> minus_;
  std::vector<double> readings_;
  TemperaturePlaces temperature_places_;
  std::vector<double> temperatures_;
  std::optional<SensorTemperature> temperature_;
  std::size_t defective_ = 0;
  bool saturated_ = false;
};

// Reduces the rows of a reader, one after the other.
class RowReduction {
 public:
  RowReduction(CsvReader& csv,
               const std::vector<ReadingColumn>& axes,
               const Reducer& reducer,
               const ReductionCsvOptions& options,
               std::vector<char>& buffer,
               const Sink* sink = nullptr)
      : csv_(csv),
        reducer_(reducer),
        options_(options),
        out_(buffer, sink, options.form, options.decimals),
        results_(result_names(axes, reducer, options)),
        derived_(derives(reducer, options) ? reducer.kind().derived_names.size() : 0),
        row_(csv, axes, reducer, options.temperature_column) {
    if (options.attitude != nullptr) {
      attitude_row_.emplace(csv, options.attitude_columns, *options.attitude,
                            options.temperature_column);
    }
    if (options.joint) {
      joint_row_.emplace(csv, options.joint->columns, *options.joint->reducer,
                         options.temperature_column);
    }
    for (const std::string& name : results_) {
      if (csv.column(name)) {
        throw DataError(csv.path(), csv.line(),
                        formatted("column '{}': `apply` writes a result with this name; rename or "
                                  "remove the column",
                                  name));
      }
    }
  }

  void put_header() {
    if (std::any_of(csv_.header().begin(), csv_.header().end(), &is_formula)) {
      for (const std::string& name : csv_.header()) {
        out_.put(&name == &csv_.header().front() ? "" : ",");
        out_.put(formula_safe_cell(name));
      }
    } else {
      out_.put(csv_.header_text());
    }
    for (const std::string& name : results_) {
      out_.put(",");
      out_.put(formula_safe_cell(name));
    }
    end_row();
  }

  [[nodiscard]] std::string_view rows() const { return out_.rows(); }

  ReductionCsvSummary reduce(std::size_t most_rows) {
    while (summary_.rows < most_rows) {
      const CsvReader::Row row = csv_.next();
      if (row == CsvReader::Row::end) {
        break;
      }
      ++summary_.rows;
      if (row == CsvReader::Row::defective) {
        refuse(csv_.defect());
        put_defective_row();
        put_unreadable(csv_.line());
      } else {
        put_own_cells();
        reduce_row();
      }
      end_row();
    }
    return summary_;
  }

 private:
  void end_row() {
    out_.put("\n");
    if (options_.every_row) {
      out_.hand_over();
    }
  }

  [[nodiscard]] bool holds_formula() const {
    return std::any_of(csv_.cells().begin(), csv_.cells().end(),
                       [](std::string_view cell) { return is_formula(cell); });
  }

  void put_harmless_cells() {
    bool first = true;
    for (const std::string_view cell : csv_.cells()) {
      out_.put(first ? "" : ",");
      first = false;
      out_.put(formula_safe_cell(std::string(cell)));
    }
  }

  // Writes the cells of the input row unchanged, except that an apostrophe is put before formulas.
  void put_own_cells() {
    if (holds_formula()) {
      put_harmless_cells();
    } else {
      out_.put(csv_.text());
    }
  }

  // Writes the cells of a defective input row. If the row is too short, empty cells are appended,
  // so that the results are in the right columns. Stray quotes are escaped, so that the output is
  // valid CSV.
  void put_defective_row() {
    if (csv_.text().find('"') == std::string_view::npos) {
      put_own_cells();
    } else {
      put_harmless_cells();
    }
    for (std::size_t i = csv_.cell_count(); i < csv_.header().size(); ++i) {
      out_.put(",");
    }
  }

  void put_empty_results(unsigned flag) {
    for (std::size_t i = 0; i + 1 < results_.size(); ++i) {
      out_.put_cell(not_a_number);
    }
    out_.put_flag(flag);
  }

  void put_unreadable(std::size_t line) {
    ++summary_.unreadable;
    if (summary_.first_unreadable_line == 0) {
      summary_.first_unreadable_line = line;
    }
    put_empty_results(reduction_flag::unreadable);
  }

  void put_saturated() {
    ++summary_.saturated;
    put_empty_results(reduction_flag::saturated);
  }

  void refuse(std::string_view what) const { refuse(what, csv_.line()); }
  void refuse(std::string_view what, std::size_t line) const {
    if (options_.strict) {
      throw DataError(csv_.path(), line, what);
    }
  }

  // Returns a pointer to the reader of a second instrument, or nullptr if there is none.
  static RowReader* beside(std::optional<RowReader>& row) { return row ? &*row : nullptr; }

  void reduce_row() {
    RowReader* const attitude = beside(attitude_row_);
    RowReader* const joint = beside(joint_row_);
    if (!row_.read(reducer_)) {
      if (options_.strict) {
        refuse(row_.defect());
      }
      put_unreadable(csv_.line());
      return;
    }
    if (attitude != nullptr && !attitude->read(*options_.attitude)) {
      if (options_.strict) {
        refuse(attitude->defect());
      }
      put_unreadable(csv_.line());
      return;
    }
    if (joint != nullptr && !joint->read(*options_.joint->reducer)) {
      if (options_.strict) {
        refuse(joint->defect());
      }
      put_unreadable(csv_.line());
      return;
    }
    if (row_.saturated() || (attitude != nullptr && attitude->saturated()) ||
        (joint != nullptr && joint->saturated())) {
      refuse("a reading is at or beyond the end of the axis's range");
      put_saturated();
      return;
    }
    if (reducer_.gives_components()) {
      put_components();
    } else {
      put_axes();
    }
  }

  void put_components() {
    ReadingContext context{.temperature = row_.temperature()};
    bool extrapolated = false;
    if (attitude_row_) {
      const ReducedReading attitude = options_.attitude->reduce(
          attitude_row_->readings(), {.temperature = attitude_row_->temperature()});
      context.up = attitude.field_in_sensor;
      extrapolated = attitude.extrapolated;
    }
    const ReducedReading reduced = reducer_.reduce(row_.readings(), context);
    if (!put_results(reduced, csv_.line())) {
      return;
    }
    if (options_.uncertainty != nullptr) {
      put_uncertainties(context, derived_);
    }
    const bool moved = options_.joint && put_joint(reduced.field_in_sensor, context, extrapolated);
    put_flag(reduced.derived.clamped, reduced.extrapolated || extrapolated, moved);
  }

  // Writes the results of a reading. If they are invalid, writes empty results with a flag and
  // returns false.
  bool put_results(const ReducedReading& reduced, std::size_t line) {
    if (!reduced.determined) {
      refuse("fewer than three axes face the light", line);
      put_unreadable(line);
      return false;
    }
    if (!std::isfinite(reduced.field_in_sensor.norm())) {
      refuse("the readings are too large to be reduced", line);
      put_unreadable(line);
      return false;
    }
    constexpr double far = 0.3;
    summary_.far_from_field += std::abs(reduced.residual) > far * reducer_.magnitude() ? 1U : 0U;
    for (const double component : reduced.field_in_sensor) {
      out_.put_cell(component);
    }
    out_.put_cell(reduced.residual);
    for (std::size_t i = 0; i < derived_; ++i) {
      out_.put_cell(reduced.derived.values[i]);
    }
    return true;
  }

  // Writes the angle of the joint: the angle between the verticals that the two instruments
  // measure. Returns true if the row is flagged `moved`.
  bool put_joint(const Eigen::Vector3d& field, const ReadingContext& context, bool& extrapolated) {
    const JointColumns& joint = *options_.joint;
    const ReducedReading reduced =
        joint.reducer->reduce(joint_row_->readings(), {.temperature = joint_row_->temperature()});
    const Eigen::Vector3d& others = reduced.field_in_sensor;
    extrapolated = extrapolated || reduced.extrapolated;
    std::optional<Eigen::Matrix3d> own;
    std::optional<Eigen::Matrix3d> of_others;
    if (joint.uncertainty != nullptr && joint.own_uncertainty != nullptr) {
      own = joint.own_uncertainty->field_covariance(row_.readings(), context.temperature);
      of_others =
          joint.uncertainty->field_covariance(joint_row_->readings(), joint_row_->temperature());
    }
    const JointMovement movement =
        joint_movement(field, own, others, of_others, joint.degrees_of_freedom);
    out_.put_cell(movement.angle_rad * deg_per_rad);
    if (options_.uncertainty != nullptr) {
      out_.put_cell(movement.u_rad * deg_per_rad);
    }
    constexpr double by_chance = 0.001;
    const bool is_told =
        std::isnan(movement.p_value) ? joint.alarm_rad > 0.0 : movement.p_value < by_chance;
    const bool moved = movement.angle_rad > joint.alarm_rad && is_told;
    summary_.moved += moved ? 1U : 0U;
    return moved;
  }

  void put_uncertainties(ReadingContext context, std::size_t derived) {
    if (context.up && options_.attitude_uncertainty != nullptr) {
      context.up_covariance = options_.attitude_uncertainty->field_covariance(
          attitude_row_->readings(), attitude_row_->temperature());
    }
    const ReducedUncertainty u = options_.uncertainty->at(row_.readings(), context);
    put_values(u, derived);
    if (options_.expanded) {
      put_values(u.expanded, derived);
      UncertaintyOfResults factors;
      factors.field_in_sensor = u.expanded.field_in_sensor.cwiseQuotient(u.field_in_sensor);
      factors.residual = u.expanded.residual / u.residual;
      for (std::size_t i = 0; i < derived; ++i) {
        factors.derived[i] = u.expanded.derived[i] / u.derived[i];
      }
      put_values(factors, derived);
    }
  }

  void put_values(const UncertaintyOfResults& values, std::size_t derived) {
    for (const double component : values.field_in_sensor) {
      out_.put_cell(component);
    }
    out_.put_cell(values.residual);
    for (std::size_t i = 0; i < derived; ++i) {
      out_.put_cell(values.derived[i]);
    }
  }

  void put_axes() {
    bool clamped = false;
    bool extrapolated = false;
    for (std::size_t k = 0; k < row_.readings().size(); ++k) {
      if (!std::isfinite(reduced_axis(k).component)) {
        refuse("the readings are too large to be reduced");
        put_unreadable(csv_.line());
        return;
      }
    }
    for (std::size_t k = 0; k < row_.readings().size(); ++k) {
      out_.put_cell(reduced_axis(k).component);
    }
    if (reducer_.kind().has_axis_elevation) {
      for (std::size_t k = 0; k < row_.readings().size(); ++k) {
        const ReducedAxis reduced = reduced_axis(k);
        out_.put_cell(reduced.angle_rad * deg_per_rad);
        clamped = clamped || reduced.clamped;
      }
    }
    if (reducer_.completes_third_component()) {
      const Reducer::ClosedField field = closed_field(0.0, 0.0);
      clamped = clamped || field.clamped;
      for (const double component : field.in_sensor.normalized()) {
        out_.put_cell(component);
      }
    }
    for (std::size_t k = 0; k < row_.readings().size(); ++k) {
      extrapolated = extrapolated || reduced_axis(k).extrapolated;
    }
    if (options_.uncertainty != nullptr) {
      put_axis_uncertainties();
    }
    put_flag(clamped, extrapolated);
  }

  void put_axis_uncertainties() {
    std::vector<ReadingPropagation::Axis> all;
    for (std::size_t k = 0; k < row_.readings().size(); ++k) {
      all.push_back(options_.uncertainty->at_axis(k, row_.readings()[k], row_.temperature()));
    }
    const Eigen::Vector3d u_direction = direction_uncertainty(all);
    const auto put_all = [&](auto of_component, auto of_angle, double k_direction) {
      for (const ReadingPropagation::Axis& u : all) {
        out_.put_cell(of_component(u));
      }
      for (const ReadingPropagation::Axis& u : all) {
        if (reducer_.kind().has_axis_elevation) {
          out_.put_cell(of_angle(u));
        }
      }
      for (int j = 0; j < 3 && reducer_.completes_third_component(); ++j) {
        out_.put_cell(k_direction > 0.0 ? k_direction * u_direction(j)
                                        : all.front().coverage_factor);
      }
    };
    using Axis = ReadingPropagation::Axis;
    put_all([](const Axis& u) { return u.component; },
            [](const Axis& u) { return u.angle_rad * deg_per_rad; }, 1.0);
    if (options_.expanded) {
      put_all([](const Axis& u) { return u.coverage_factor * u.component; },
              [](const Axis& u) { return u.coverage_factor * u.angle_rad * deg_per_rad; },
              all.front().coverage_factor);
      put_all([](const Axis& u) { return u.coverage_factor; },
              [](const Axis& u) { return u.coverage_factor; }, 0.0);
    }
  }

  // Computes the field from the measured components along the two axes, increased by `first` and
  // `second`.
  [[nodiscard]] Reducer::ClosedField closed_field(double first, double second) const {
    const std::span<const double> readings = row_.readings();
    return reducer_.closed_field(readings[0] + first * reducer_.sensitivity_of(0),
                                 readings[1] + second * reducer_.sensitivity_of(1),
                                 row_.temperature());
  }

  // Returns the uncertainties of the three components of the direction, computed from those of the
  // two measured components. They are zero if the axes do not determine the direction.
  [[nodiscard]] Eigen::Vector3d direction_uncertainty(
      const std::vector<ReadingPropagation::Axis>& components) const {
    Eigen::Vector3d variance = Eigen::Vector3d::Zero();
    if (!reducer_.completes_third_component()) {
      return variance;
    }
    const double step = 1e-5 * reducer_.magnitude();
    for (std::size_t k = 0; k < 2; ++k) {
      const auto moved = [&](double by) -> Eigen::Vector3d {
        return closed_field(k == 0 ? by : 0.0, k == 1 ? by : 0.0).in_sensor.normalized();
      };
      const Eigen::Vector3d change =
          (moved(step) - moved(-step)) / (2.0 * step) * components[k].component;
      variance += change.cwiseAbs2();
    }
    return variance.cwiseSqrt();
  }

  [[nodiscard]] ReducedAxis reduced_axis(std::size_t k) const {
    return reducer_.reduce_axis(k, row_.readings()[k], row_.temperature());
  }

  void put_flag(bool clamped, bool extrapolated, bool moved = false) {
    out_.put_flag((clamped ? reduction_flag::clamped : 0U) |
                  (extrapolated ? reduction_flag::extrapolated : 0U) |
                  (moved ? reduction_flag::moved : 0U));
    summary_.clamped += clamped ? 1U : 0U;
    summary_.extrapolated += extrapolated ? 1U : 0U;
  }

  CsvReader& csv_;
  const Reducer& reducer_;
  const ReductionCsvOptions& options_;
  RowWriter out_;
  std::vector<std::string> results_;
  std::size_t derived_;  // number of derived values, see derived_count()
  RowReader row_;
  std::optional<RowReader> attitude_row_;
  std::optional<RowReader> joint_row_;
  ReductionCsvSummary summary_;
};

void add(const ReductionCsvSummary& more, ReductionCsvSummary& summary) {
  summary.rows += more.rows;
  summary.unreadable += more.unreadable;
  if (summary.first_unreadable_line == 0) {
    summary.first_unreadable_line = more.first_unreadable_line;
  }
  summary.clamped += more.clamped;
  summary.far_from_field += more.far_from_field;
  summary.extrapolated += more.extrapolated;
  summary.saturated += more.saturated;
  summary.moved += more.moved;
}

}  // namespace

std::vector<ReadingColumn> reading_columns(const Instrument& instrument) {
  std::vector<ReadingColumn> columns;
  for (const std::string& axis : instrument.axes) {
    ReadingColumn column{.axis = axis, .plus = axis, .minus = ""};
    for (const DifferentialAxis& difference : instrument.differences) {
      if (difference.axis == axis) {
        column.plus = difference.plus;
        column.minus = difference.minus;
      }
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

std::vector<ReadingColumn> columns_in(const CsvReader& csv, const Calibration& calibration) {
  std::vector<ReadingColumn> columns = reading_columns(calibration.sensor.instrument);
  const std::string& slot = calibration.provenance.slot;
  if (slot.empty() || csv.column(columns.front().plus)) {
    return columns;
  }
  for (ReadingColumn& column : columns) {
    column.axis.insert(0, slot + ".");
    column.plus.insert(0, slot + ".");
    if (!column.minus.empty()) {
      column.minus.insert(0, slot + ".");
    }
  }
  return columns;
}

TemperaturePlaces temperature_places(const CsvReader& csv,
                                     const std::vector<ReadingColumn>& axes,
                                     const SensorModel& sensor,
                                     const std::string& column) {
  if (!sensor.temperature) {
    return {};
  }
  return sensor.temperature->has_own_sensors()
             ? own_temperatures(csv, axes)
             : TemperaturePlaces{one_temperature(csv, axes, column)};
}

ReductionCsvSummary reduce_csv(CsvReader& csv,
                               const std::vector<ReadingColumn>& axes,
                               const Reducer& reducer,
                               const ReductionCsvOptions& options,
                               const Sink& sink) {
  constexpr std::size_t all = std::numeric_limits<std::size_t>::max();
  std::vector<char> buffer;
  RowReduction whole(csv, axes, reducer, options, buffer, &sink);
  whole.put_header();
  if (options.every_row) {
    return whole.reduce(all);
  }
  sink(whole.rows());
  struct Piece {
    std::vector<char> buffer;
    std::string_view rows;  // the output rows, which are in `buffer`
    ReductionCsvSummary summary;
  };
  std::vector<std::vector<char>> spare;  // buffers of finished pieces, to be used again
  const auto reduced = [&](CsvReader& from, std::size_t most_rows, std::vector<char> to) {
    Piece piece{.buffer = std::move(to)};
    RowReduction rows(from, axes, reducer, options, piece.buffer);
    piece.summary = rows.reduce(most_rows);
    piece.rows = rows.rows();
    return piece;
  };
  const auto spare_buffer = [&] {
    std::vector<char> found;
    if (!spare.empty()) {
      found = std::move(spare.back());
      spare.pop_back();
    }
    return found;
  };
  const auto next = [&]() -> std::optional<std::function<Piece()>> {
    if (std::optional<CsvReader::Lines> lines = csv.take_lines()) {
      const auto from = std::make_shared<CsvReader>(csv, *std::move(lines));
      const auto to = std::make_shared<std::vector<char>>(spare_buffer());
      return [&reduced, from, to] { return reduced(*from, all, std::move(*to)); };
    }
    // If the table contains quotes, only a CSV parser finds the ends of the rows. Therefore this
    // thread reads and reduces them itself.
    constexpr std::size_t some = 1000;
    const auto piece = std::make_shared<Piece>(reduced(csv, some, spare_buffer()));
    return piece->summary.rows > 0 ? std::optional([piece] { return std::move(*piece); })
                                   : std::nullopt;
  };
  ReductionCsvSummary summary;
  const auto take = [&](Piece piece) {
    sink(piece.rows);
    add(piece.summary, summary);
    spare.push_back(std::move(piece.buffer));
  };
  // Largest number of threads. The limit keeps memory use low: each thread needs about a megabyte.
  constexpr std::size_t most_cores = 8;
  for_each_in_order<Piece>(next, take, std::min(worker_count(), most_cores));
  return summary;
}

std::string reduction_npy_header(const std::vector<ReadingColumn>& axes,
                                 const Reducer& reducer,
                                 const ReductionCsvOptions& options,
                                 std::size_t rows) {
  std::string columns;
  for (std::string name : result_names(axes, reducer, options)) {
    for (std::size_t at = name.find_first_of("'\\"); at != std::string::npos;
         at = name.find_first_of("'\\", at + 2)) {
      name.insert(at, 1, '\\');
    }
    columns += formatted("{}('{}', '{}')", columns.empty() ? "" : ", ", name,
                         name == "flag" ? "|u1" : "<f8");
  }
  return npy_header('[' + columns + ']', formatted("({},)", rows));
}

}  // namespace axiscal
