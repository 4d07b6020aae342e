// SPDX-License-Identifier: Apache-2.0
#include "report/src/coefficients_section.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"

namespace axiscal {
namespace {

// The reference temperatures of the temperature terms, as text.
std::string reference_temperatures(const Calibration& calibration) {
  return span_text(*calibration.sensor.temperature, calibration.sensor.instrument.axes,
                   [](const TemperatureSpan& span) { return rounded(span.reference, 6); });
}

std::string parameters_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  const std::vector<ParameterUncertainty> all = parameter_uncertainties(calibration);
  for (const ParameterUncertainty& one : all) {
    rows.push_back({{one.name, ""},
                    rounded_cell(one.value, one.uncertainty.expanded),
                    number_cell(one.uncertainty.u, 2),
                    number_cell(one.uncertainty.expanded, 2),
                    number_cell(one.uncertainty.degrees_of_freedom, 3),
                    {parameter_unit(calibration, one.name), ""}});
  }
  if (all.empty()) {
    for (const std::string& axis : calibration.sensor.instrument.axes) {
      for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
        const std::string name = axis + of;
        rows.push_back({{name, ""},
                        number_cell(parameter_value(calibration.sensor, name), 8),
                        {},
                        {},
                        {},
                        {parameter_unit(calibration, name), ""}});
      }
    }
  }
  const std::string over = calibration.sensor.temperature ? "; d is the temperature minus " +
                                                                reference_temperatures(calibration)
                                                          : "";
  return html_table("Parameters and their uncertainties" + over,
                    {"parameter", "value", "u", "U (95 %)", "degrees of freedom", "unit"}, rows);
}

std::string intrinsic_table(const Calibration& calibration) {
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < intrinsic.names.size(); ++i) {
    const bool is_angle = intrinsic.names[i].starts_with("angle.");
    const double factor = is_angle ? deg_per_rad : 1.0;
    const double expanded =
        i < intrinsic.uncertainty.size() ? intrinsic.uncertainty[i].expanded : std::nan("");
    rows.push_back(
        {{intrinsic.names[i], ""},
         rounded_cell(factor * intrinsic.values(static_cast<Eigen::Index>(i)), factor * expanded),
         number_cell(factor * expanded, 2),
         {is_angle ? "deg"
          : intrinsic.names[i].ends_with("bias")
              ? calibration.sensor.instrument.unit
              : unit_per(calibration.sensor.instrument.unit, calibration.sensor.field.unit),
          ""}});
  }
  return html_table("Independent of the mounting", {"parameter", "value", "U (95 %)", "unit"},
                    rows);
}

std::string polar_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  for (Eigen::Index k = 0; k < calibration.sensor.instrument.axis_count(); ++k) {
    const int main = main_axis(calibration.sensor.instrument, calibration.sensor.response, k);
    const PolarForm polar =
        polar_from_sensitivity(calibration.sensor.response.sensitivity.row(k).transpose(), main,
                               calibration.sensor.instrument.convention);
    rows.push_back({{calibration.sensor.instrument.axes[static_cast<std::size_t>(k)], ""},
                    number_cell(std::abs(polar.sensitivity), 8),
                    number_cell(polar.coning_angle_rad * deg_per_rad, 5),
                    number_cell(polar.azimuth_rad * deg_per_rad, 5)});
  }
  return html_table(
      "Polar form: magnitude of the sensitivity and direction of the axis; the azimuth is defined "
      "as by Tripp and Tcheng, for axes forward, right and down",
      {"axis", "magnitude", "angle to nominal axis [deg]", "azimuth [deg]"}, rows);
}

std::string correlation_table(const Calibration& calibration) {
  const Eigen::MatrixXd covariance = parameter_covariance(calibration);
  if (covariance.size() == 0 || !covariance.allFinite()) {
    return "";
  }
  const std::vector<std::string>& names = calibration.fit.statistics->parameter_names;
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  std::vector<std::string> head = {"with"};
  head.insert(head.end(), names.begin(), names.end());
  std::vector<std::vector<Cell>> rows;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    rows.push_back({{names[static_cast<std::size_t>(i)], ""}});
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double r = covariance(i, j) / (sd(i) * sd(j));
      constexpr double rounding = 1e-12;
      rows.back().push_back(number_cell(std::abs(r) < rounding ? 0.0 : r, 2));
    }
  }
  return html_table("Correlation of the coefficients", head, rows);
}

// Returns a table of the rotations of the assembly's other instruments relative to this instrument.
std::string alignments_table(const Calibration& calibration) {
  std::vector<std::vector<Cell>> rows;
  for (const SlotAlignment& other : calibration.fit.slot_alignments) {
    const Eigen::Vector3d turn = rotation_without_quarter_turns(other);
    std::vector<Cell>& row = rows.emplace_back(std::vector<Cell>{{other.slot, ""}});
    for (Eigen::Index j = 0; j < 3; ++j) {
      row.push_back(number_cell(1e3 * turn(j)));
      row.push_back(number_cell(1e3 * other.expanded_rad(j), 2));
    }
  }
  return rows.empty() ? ""
                      : html_table("Rotations of the other instruments relative to this one [mrad]",
                                   {"slot", "about x", "U (95 %)", "about y", "U (95 %)", "about z",
                                    "U (95 %)"},
                                   rows);
}

}  // namespace

std::string coefficients_matrix(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const std::vector<ParameterUncertainty> all = parameter_uncertainties(calibration);
  const auto expanded_of = [&](const std::string& name) {
    const auto at = std::find_if(all.begin(), all.end(),
                                 [&](const ParameterUncertainty& one) { return one.name == name; });
    return at == all.end() ? std::nan("") : at->uncertainty.expanded;
  };
  const std::string per_field = unit_per(instrument.unit, calibration.sensor.field.unit);
  std::vector<std::string> head = {"axis", formatted("bias [{}]", instrument.unit)};
  std::vector<std::vector<Cell>> columns;
  for (const char* const of : {".bias", ".sensitivity.x", ".sensitivity.y", ".sensitivity.z"}) {
    std::vector<std::pair<double, double>> column;
    for (const std::string& axis : instrument.axes) {
      column.emplace_back(parameter_value(calibration.sensor, axis + of), expanded_of(axis + of));
    }
    columns.push_back(quantity_cells(column));
    if (columns.size() > 1) {
      head.push_back(formatted("S{} [{}]", of[sizeof(".sensitivity.") - 1], per_field));
    }
  }
  std::vector<std::vector<Cell>> rows;
  for (std::size_t k = 0; k < instrument.axes.size(); ++k) {
    rows.push_back({{instrument.axes[k], ""}});
    for (const std::vector<Cell>& column : columns) {
      rows.back().push_back(column[k]);
    }
  }
  std::string caption =
      "reading = bias + Sx fx + Sy fy + Sz fz; f is the field in the instrument's frame";
  caption += all.empty() ? "" : "; the number after \u00b1 is the expanded uncertainty U (95 %)";
  caption += calibration.sensor.temperature
                 ? "; at temperature " + reference_temperatures(calibration)
                 : "";
  return html_table(caption, head, rows);
}

std::string more_coefficients(const Calibration& calibration) {
  return parameters_table(calibration) + intrinsic_table(calibration) + polar_table(calibration) +
         alignments_table(calibration) + correlation_table(calibration);
}

}  // namespace axiscal
