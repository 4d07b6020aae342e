// SPDX-License-Identifier: Apache-2.0
#ifdef AXISCAL_XLSXWRITER

#include <array>
#include <cmath>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>
#include <xlsxwriter.h>

#include <Eigen/LU>

#include "axiscal/calib/reduction.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/inclination.hpp"
#include "core/formatted.hpp"
#include "core/temporary_file.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

constexpr int example_rows = 12;
constexpr double yaw_above_deg = 85.0;

// Returns the name of a cell, such as "C7". For a cell of the first sheet, coefficient() returns
// the full name, such as "Coefficients!$C$7".
std::string cell_name(int row, int column) {
  return formatted("{}{}", static_cast<char>('A' + column), row + 1);
}

std::string coefficient(int row, int column) {
  return formatted("Coefficients!${}${}", static_cast<char>('A' + column), row + 1);
}

// A worksheet. Rows and columns are numbered from 0.
class Sheet {
 public:
  Sheet(lxw_workbook* book, const char* name) : sheet_(workbook_add_worksheet(book, name)) {}

  void text(int row, int column, const std::string& value, lxw_format* format = nullptr) {
    check(worksheet_write_string(sheet_, at(row), place(column), value.c_str(), format));
  }
  void number(int row, int column, double value, lxw_format* format = nullptr) {
    if (std::isfinite(value)) {
      check(worksheet_write_number(sheet_, at(row), place(column), value, format));
    }
  }
  // @param value  result of the formula, stored for programs that do not evaluate formulas. NaN
  //               means that the result is a text.
  void formula(int row, int column, const std::string& text, double value) {
    check(std::isnan(value) ? worksheet_write_formula_str(sheet_, at(row), place(column),
                                                          text.c_str(), nullptr, "")
                            : worksheet_write_formula_num(sheet_, at(row), place(column),
                                                          text.c_str(), nullptr, value));
  }
  void width(int first, int last, double characters) {
    check(worksheet_set_column(sheet_, place(first), place(last), characters, nullptr));
  }
  void freeze(int rows) { worksheet_freeze_panes(sheet_, at(rows), 0); }

 private:
  static lxw_row_t at(int row) { return static_cast<lxw_row_t>(row); }
  static lxw_col_t place(int column) { return static_cast<lxw_col_t>(column); }
  static void check(lxw_error error) {
    if (error != LXW_NO_ERROR) {
      throw OutputError(std::string("xlsx: ") + lxw_strerror(error));
    }
  }

  lxw_worksheet* sheet_;
};

// A workbook of two sheets. The first contains the coefficients. The second contains readings, and
// the fields computed from them.
class Workbook {
 public:
  Workbook(const Calibration& calibration, const std::string& path)
      : c_(calibration),
        m_(static_cast<int>(calibration.sensor.instrument.axis_count())),
        reducer_(calibration, {}, Force::yes),
        book_(workbook_new(path.c_str())),
        heading_(workbook_add_format(book_)),
        input_(workbook_add_format(book_)) {
    format_set_bold(heading_);
    format_set_bg_color(input_, 0xFFF8DC);
    std::string title = "Calibration by axiscal";
    lxw_doc_properties properties{};
    properties.title = title.data();
    properties.created =
        static_cast<std::time_t>(parse_timestamp(calibration.provenance.created).value_or(0.0));
    workbook_set_properties(book_, &properties);
  }

  void write() {
    Sheet coefficients(book_, "Coefficients");
    Sheet readings(book_, "Readings");
    put_coefficients(coefficients);
    put_readings(readings);
    if (const lxw_error error = workbook_close(book_); error != LXW_NO_ERROR) {
      throw OutputError(std::string("xlsx: ") + lxw_strerror(error));
    }
  }

 private:
  [[nodiscard]] const SensorModel& sensor() const { return c_.sensor; }
  [[nodiscard]] int order() const {
    return sensor().temperature ? static_cast<int>(sensor().temperature->bias.cols()) : 0;
  }
  [[nodiscard]] bool own_temperatures() const {
    return sensor().temperature && sensor().temperature->has_own_sensors();
  }

  // Rows of the first sheet: title, instrument and magnitude; then a table with one row per axis;
  // then the inverse matrix with one row per component of the field.
  static constexpr int magnitude_row = 4;
  static constexpr int table_row = 7;
  [[nodiscard]] int axis_row(int axis) const { return table_row + 1 + axis; }
  [[nodiscard]] int inverse_row(int component) const { return table_row + m_ + 4 + component; }
  // Columns of the table of axes: name, bias, three sensitivities, reference temperature,
  // temperature terms of the bias, temperature terms of the scale.
  static constexpr int bias_column = 1;
  static constexpr int sensitivity_column = 2;
  static constexpr int reference_column = 5;
  [[nodiscard]] int bias_term(int power) const { return reference_column + power; }
  [[nodiscard]] int scale_term(int power) const { return reference_column + order() + power; }

  void put_coefficients(Sheet& sheet) {
    const Instrument& instrument = sensor().instrument;
    sheet.width(0, 0, 22);
    sheet.width(1, 12, 18);
    sheet.text(0, 0, formatted("{} {}", instrument.kind, instrument.serial), heading_);
    sheet.text(1, 0,
               formatted("calibrated {}, {}; readings in {}, field {} in {}",
                         c_.provenance.date().substr(0, 10), c_.provenance.software,
                         instrument.unit, sensor().field.kind, sensor().field.unit));
    sheet.text(2, 0,
               order() > 0 ? "reading = bias(t) + scale(t) (sensitivity . field), bias(t) = bias + "
                             "b1 d + .., scale(t) = 1 + c1 d + .., d = temperature - t0"
                           : "reading = bias + sensitivity . field");
    sheet.text(magnitude_row, 0, "magnitude of the field", heading_);
    sheet.number(magnitude_row, 1, sensor().field.magnitude, input_);
    sheet.text(magnitude_row, 2,
               "where the readings were taken; change this value for another place");
    std::vector<std::string> titles = {"axis", "bias", "sensitivity x", "sensitivity y",
                                       "sensitivity z"};
    if (order() > 0) {
      titles.emplace_back("t0");
    }
    for (const char letter : {'b', 'c'}) {
      for (int power = 1; power <= order(); ++power) {
        titles.push_back(formatted("{}{}", letter, power));
      }
    }
    for (std::size_t i = 0; i < titles.size(); ++i) {
      sheet.text(table_row, static_cast<int>(i), titles[i], heading_);
    }
    for (int k = 0; k < m_; ++k) {
      sheet.text(axis_row(k), 0, instrument.axes[static_cast<std::size_t>(k)]);
      sheet.number(axis_row(k), bias_column, sensor().response.bias(k));
      for (int j = 0; j < 3; ++j) {
        sheet.number(axis_row(k), sensitivity_column + j, sensor().response.sensitivity(k, j));
      }
      if (order() > 0) {
        const TemperatureResponse& over = *sensor().temperature;
        sheet.number(axis_row(k), reference_column, over.span_of(k).reference);
        for (int power = 1; power <= order(); ++power) {
          sheet.number(axis_row(k), bias_term(power), over.bias(k, power - 1));
          sheet.number(axis_row(k), scale_term(power), over.scale(k, power - 1));
        }
      }
    }
    if (m_ == 3) {
      put_inverse(sheet);
    }
    put_uncertainties(sheet);
  }

  // Writes formulas that compute the inverse of the sensitivity matrix by cofactors.
  void put_inverse(Sheet& sheet) {
    const Eigen::Matrix3d S = sensor().response.sensitivity;
    const Eigen::Matrix3d inverse = S.inverse();
    const auto s = [&](int k, int j) {
      return cell_name(axis_row(k % 3), sensitivity_column + j % 3);
    };
    const auto minor = [&](int k, int j) {  // minor of the matrix entry in row k and column j
      return formatted("({}*{}-{}*{})", s(k + 1, j + 1), s(k + 2, j + 2), s(k + 1, j + 2),
                       s(k + 2, j + 1));
    };
    const std::string determinant = formatted("({}*{}+{}*{}+{}*{})", s(0, 0), minor(0, 0), s(0, 1),
                                              minor(0, 1), s(0, 2), minor(0, 2));
    sheet.text(inverse_row(0) - 1, 0, "field = inverse . u, u = (reading - bias(t)) / scale(t)",
               heading_);
    for (int j = 0; j < 3; ++j) {
      sheet.text(inverse_row(j), 0, std::string("field ") + "xyz"[j]);
      for (int k = 0; k < 3; ++k) {
        sheet.formula(inverse_row(j), 1 + k, formatted("={}/{}", minor(k, j), determinant),
                      inverse(j, k));
      }
    }
  }

  void put_uncertainties(Sheet& sheet) {
    int row = inverse_row(3) + 1;
    const std::vector<ParameterUncertainty> all = parameter_uncertainties(c_);
    if (all.empty()) {
      return;
    }
    const std::vector<std::string> titles = {"parameter", "value", "u", "U (95 %)", "k", "unit"};
    for (std::size_t i = 0; i < titles.size(); ++i) {
      sheet.text(row, static_cast<int>(i), titles[i], heading_);
    }
    for (const ParameterUncertainty& one : all) {
      ++row;
      sheet.text(row, 0, one.name);
      sheet.number(row, 1, one.value);
      sheet.number(row, 2, one.uncertainty.u);
      sheet.number(row, 3, one.uncertainty.expanded);
      sheet.number(row, 4, one.uncertainty.coverage_factor);
      sheet.text(row, 5, parameter_unit(c_, one.name));
    }
  }

  // Returns the number of temperature columns. They are between the axes and the results.
  [[nodiscard]] int temperature_columns() const {
    return order() == 0 ? 0 : own_temperatures() ? m_ : 1;
  }
  [[nodiscard]] int first_result() const { return m_ + temperature_columns(); }

  // Returns the formula (v - bias(t)) / scale(t) of axis k, for a row of readings.
  [[nodiscard]] std::string bias_corrected(int row, int k) const {
    const std::string v = cell_name(row, k);
    if (order() == 0) {
      return formatted("({}-{})", v, coefficient(axis_row(k), bias_column));
    }
    const std::string d = formatted("({}-{})", cell_name(row, m_ + (own_temperatures() ? k : 0)),
                                    coefficient(axis_row(k), reference_column));
    const auto polynomial = [&](auto term) {  // Horner's scheme; no constant term
      std::string text = "0";
      for (int power = order(); power >= 1; --power) {
        text = formatted("({}+{})*{}", text, coefficient(axis_row(k), term(power)), d);
      }
      return text;
    };
    return formatted("(({}-{}-{})/(1+{}))", v, coefficient(axis_row(k), bias_column),
                     polynomial([&](int power) { return bias_term(power); }),
                     polynomial([&](int power) { return scale_term(power); }));
  }

  void put_readings(Sheet& sheet) {
    const Instrument& instrument = sensor().instrument;
    sheet.width(0, 14, 16);
    std::vector<std::string> titles = instrument.axes;
    if (own_temperatures()) {
      for (const std::string& axis : instrument.axes) {
        titles.push_back(axis + "_temperature");
      }
    } else if (order() > 0) {
      titles.emplace_back("temperature");
    }
    for (const std::string& name : result_names()) {
      titles.push_back(name);
    }
    for (std::size_t i = 0; i < titles.size(); ++i) {
      sheet.text(0, static_cast<int>(i), titles[i], heading_);
    }
    sheet.freeze(1);
    for (int i = 0; i < example_rows; ++i) {
      put_example(sheet, i + 1, i);
    }
    sheet.text(example_rows + 2, 0,
               "These readings are examples: put your own readings in the coloured cells, and copy "
               "the formulas down for more readings.");
  }

  [[nodiscard]] std::vector<std::string> result_names() const {
    std::vector<std::string> names;
    if (m_ == 3) {
      names = {"field_x", "field_y", "field_z", "residual"};
      if (!reducer_.kind().derives_with_attitude) {
        for (const std::string_view name : reducer_.kind().derived_names) {
          names.emplace_back(name);
        }
      }
      return names;
    }
    for (const std::string& axis : sensor().instrument.axes) {
      names.push_back("component_" + axis);
    }
    for (const std::string& axis : sensor().instrument.axes) {
      if (reducer_.kind().has_axis_elevation) {
        names.push_back(formatted("angle_{}_deg", axis));
      }
    }
    return names;
  }

  // Writes a row with an example. It contains the reading in one attitude, and the results with
  // their formulas.
  void put_example(Sheet& sheet, int row, int number) {
    constexpr std::array<std::pair<double, double>, example_rows> attitudes_deg = {
        {{0.0, 0.0},
         {10.0, 20.0},
         {-10.0, -40.0},
         {30.0, 90.0},
         {-30.0, 170.0},
         {60.0, -120.0},
         {-60.0, 60.0},
         {80.0, -20.0},
         {87.0, 10.0},
         {-87.0, -30.0},
         {45.0, 135.0},
         {-45.0, -90.0}}};
    const auto& [pitch_deg, roll_deg] = attitudes_deg[static_cast<std::size_t>(number)];
    const Eigen::Vector3d direction =
        rotation_sensor_from_level(pitch_deg * rad_per_deg, roll_deg * rad_per_deg, 0.0,
                                   sensor().instrument.convention)
            .col(2);
    std::optional<SensorTemperature> temperature;
    if (order() > 0) {
      std::vector<double> all;
      for (const TemperatureSpan& span : sensor().temperature->spans) {
        all.push_back(span.low + (span.high - span.low) * number / example_rows);
      }
      temperature = all.size() == 1 ? SensorTemperature(all.front()) : SensorTemperature(all);
    }
    const Eigen::VectorXd exact =
        response_at(sensor(), sensor().field.magnitude * direction, temperature);
    std::vector<double> v;
    for (int k = 0; k < m_; ++k) {
      // The reading is rounded to the digits that the file stores, so that values and formulas
      // agree.
      v.push_back(parse_number(number_text(exact(k), 12)).value_or(exact(k)));
      sheet.number(row, k, v.back(), input_);
    }
    for (int t = 0; t < temperature_columns(); ++t) {
      sheet.number(row, m_ + t, temperature->of(t), input_);
    }
    if (m_ == 3) {
      put_components(sheet, row, reducer_.reduce(v, {.temperature = temperature}));
    } else {
      put_axes(sheet, row, v, temperature);
    }
  }

  void put_components(Sheet& sheet, int row, const ReducedReading& reduced) {
    const std::string F = coefficient(magnitude_row, 1);
    int column = first_result();
    std::array<std::string, 3> f;
    for (int j = 0; j < 3; ++j) {
      std::string sum;
      for (int k = 0; k < 3; ++k) {
        sum += formatted("{}{}*{}", k == 0 ? "" : "+", coefficient(inverse_row(j), 1 + k),
                         bias_corrected(row, k));
      }
      f[static_cast<std::size_t>(j)] = cell_name(row, column);
      sheet.formula(row, column++, "=" + sum, reduced.field_in_sensor(j));
    }
    const std::string length = formatted("SQRT({}^2+{}^2+{}^2)", f[0], f[1], f[2]);
    sheet.formula(row, column++, formatted("={}-{}", length, F), reduced.residual);
    const std::span<const std::string_view> names = reduced.derived_names;
    const std::string sign =
        sensor().instrument.convention == AxisConvention::forward_right_down ? "-" : "";
    const std::string pitch = cell_name(row, column);
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::string text;
      if (names[i] == "pitch_deg") {
        text = formatted("=DEGREES(ASIN(MAX(-1,MIN(1,{}/{}))))", f[0], F);
      } else if (names[i] == "roll_deg") {
        text = formatted("=IF(ABS({})>={},\"\",DEGREES(ATAN2({}{},{}{})))", pitch, yaw_above_deg,
                         sign, f[2], sign, f[1]);
      } else if (names[i] == "yaw_deg") {
        text = formatted("=IF(ABS({})>={},DEGREES(ATAN2({},{}{})),\"\")", pitch, yaw_above_deg,
                         f[0], sign, f[1]);
      } else if (names[i].starts_with("direction_")) {
        text = formatted("={}/{}", f[i % 3], length);
      } else {  // no formula exists for this value
        sheet.number(row, column++, reduced.derived.values[i]);
        continue;
      }
      sheet.formula(row, column++, text, reduced.derived.values[i]);
    }
  }

  void put_axes(Sheet& sheet,
                int row,
                const std::vector<double>& v,
                const std::optional<SensorTemperature>& temperature) {
    int column = first_result();
    for (int k = 0; k < m_; ++k) {
      const std::string length =
          formatted("SQRT({}^2+{}^2+{}^2)", coefficient(axis_row(k), sensitivity_column),
                    coefficient(axis_row(k), sensitivity_column + 1),
                    coefficient(axis_row(k), sensitivity_column + 2));
      const auto axis = static_cast<std::size_t>(k);
      sheet.formula(row, column++, formatted("={}/{}", bias_corrected(row, k), length),
                    reducer_.reduce_axis(axis, v[axis], temperature).component);
    }
    for (int k = 0; k < m_ && reducer_.kind().has_axis_elevation; ++k) {
      const auto axis = static_cast<std::size_t>(k);
      sheet.formula(row, column++,
                    formatted("=DEGREES(ASIN(MAX(-1,MIN(1,{}/{}))))",
                              cell_name(row, first_result() + k), coefficient(magnitude_row, 1)),
                    reducer_.reduce_axis(axis, v[axis], temperature).angle_rad * deg_per_rad);
    }
  }

  const Calibration& c_;
  int m_;
  Reducer reducer_;
  lxw_workbook* book_;
  lxw_format* heading_;
  lxw_format* input_;
};

}  // namespace

Exported export_xlsx(const Calibration& record, const ExportOptions&) {
  const Calibration calibration = in_assembly_frame(record);  // `apply` uses this frame too
  const SensorModel& sensor = calibration.sensor;
  if (sensor.instrument.axis_count() > 3 || sensor.instrument.one_sided || !sensor.also.empty() ||
      !gives_field(calibration)) {
    throw RefusedError(
        "xlsx: the formulas of the sheet support up to three axes; they do not support one-sided "
        "axes, second fields ('also') or biases that include the response to the field");
  }
  const TemporaryFile temporary;
  Workbook(calibration, temporary.path()).write();
  return {.content = read_whole_file(temporary.path()), .loss = std::nullopt};
}

}  // namespace axiscal

#endif
