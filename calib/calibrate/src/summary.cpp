// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/summary.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>

#include "axiscal/calib/assembly.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/orientation_quality.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/core/wrapped_text.hpp"
#include "axiscal/field/field_kind.hpp"
#include "axiscal/instruments/polar_form.hpp"
#include "calib/record/calibration_warning.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

constexpr int cell_width = 14;

constexpr std::size_t longest_label = 17;  // with longer labels, a row would exceed 80 columns

std::string cell(const std::string& text) {
  return formatted("{:>{}}", text, cell_width);
}

std::string row(std::string_view label, std::size_t width, const std::vector<std::string>& cells) {
  std::string line = formatted("  {:<{}}", label, width);
  for (const std::string& text : cells) {
    line += cell(text);
  }
  return line + "\n";
}

std::string counted(std::size_t count, const std::string& noun) {
  return formatted("{} {}{}", count, noun, count == 1 ? "" : "s");
}

class Summary {
 public:
  explicit Summary(const Calibration& calibration)
      : c_(calibration),
        statistics_(calibration.fit.statistics ? *calibration.fit.statistics : blank_),
        uncertainties_(parameter_uncertainties(calibration)) {
    for (const std::string& axis : c_.sensor.instrument.axes) {
      label_width_ = std::max(label_width_, axis.size() + 1);
    }
    label_width_ = std::min(label_width_, longest_label + 1);
  }

  // Returns the summary for SummaryDetail::brief.
  std::string brief() {
    append_readings_sentence();
    text_ = wrapped(in_one_line(text_), 80) + "\n";
    constexpr std::size_t most_axes = 6;
    add_coefficients(most_axes);
    text_ += "\n";
    add_also();
    add_in_short();
    add_quantities();
    text_ += text_.ends_with("\n\n") ? "" : "\n";
    for (const std::string& words :
         {field_size_sentence(c_), confirmation_sentence(c_), not_counted_sentence(c_)}) {
      text_ += words.empty() ? "" : wrapped(words, 80) + "\n";
    }
    return text_;
  }

  std::string text() {
    append_readings_sentence();
    add_coefficients(c_.sensor.instrument.axes.size());
    add_also();
    add_temperature();
    add_axes();
    add_polar_fit();
    add_quantities();
    add_levelness();
    add_alignments();
    add_orientations();
    add_quality();
    return text_;
  }

 private:
  void heading(const std::string& title) { text_ += formatted("\n{}\n", wrapped(title, 80)); }

  void append_readings_sentence() {
    const Instrument& instrument = c_.sensor.instrument;
    text_ += instrument.kind;
    text_ += instrument.serial.empty() ? "" : " " + instrument.serial;
    text_ += c_.provenance.slot.empty() ? "" : " in slot " + c_.provenance.slot;
    text_ += formatted(
        ": {}, readings in {}\n",
        instrument.axes.size() == 1 ? "1 axis" : formatted("{} axes", instrument.axes.size()),
        instrument.unit == "1" ? "units of 1" : instrument.unit);
    text_ +=
        formatted("field {}, magnitude {:.7g}{}", c_.sensor.field.kind, c_.sensor.field.magnitude,
                  c_.sensor.field.unit == "1" ? "" : " " + c_.sensor.field.unit);
    if (c_.sensor.field.magnitude_u > 0.0) {
      text_ += formatted(" (standard uncertainty {:.2g})", c_.sensor.field.magnitude_u);
    }
    text_ +=
        c_.sensor.field.model.empty() ? "\n" : formatted(", model {}\n", c_.sensor.field.model);
    std::set<DesignPoint> points;
    std::set<int> blocks;
    for (const ReadingResidual& residual : c_.fit.residuals) {
      if (residual.used && residual.point) {
        points.insert(*residual.point);
        blocks.insert(residual.block.value_or(1));
      }
    }
    std::string files;
    for (const InputFileDigest& input : c_.provenance.inputs) {
      files += (files.empty() ? "" : ", ") + input.path;
    }
    std::string used = files.empty() ? "" : files + ": ";
    if (!c_.fit.statistics) {
      text_ += used.empty() ? "" : wrapped(used, 80) + "\n";
      return;
    }
    used += method_kind(c_.fit.method).by_turns
                ? counted(static_cast<std::size_t>(statistics_.observations), "turn")
                : formatted("{} of {} used", statistics_.observations,
                            counted(c_.fit.residuals.size(), "reading"));
    if (!points.empty()) {
      used += formatted(", at {} in {}", counted(points.size(), "design point"),
                        counted(blocks.size(), "block"));
    }
    text_ += wrapped(used, 80) + "\n";
    std::string method = "method " + std::string(method_name(c_.fit.method));
    const MethodKind& kind = method_kind(c_.fit.method);
    method += kind.averages_pairs ? formatted(": {} of opposite positions",
                                              counted(statistics_.rows.size(), "average"))
                                  : formatted(": {}", kind.words);
    if (kind.by_magnitude) {
      method += ", sensitivity matrix taken as " + std::string(shape_name(c_.fit.shape));
    }
    method += c_.fit.weights == Weighting::none
                  ? ""
                  : "; weighted by " + std::string(weighting_name(c_.fit.weights));
    method += c_.fit.robust ? "; robust (bisquare)" : "";
    method += c_.provenance.positioner.empty() ? "" : "; cube " + c_.provenance.positioner;
    text_ += wrapped(method, 80) + "\n";
  }

  // @param most  largest number of axes that are shown.
  void add_coefficients(std::size_t most) {
    const std::string unit = c_.sensor.instrument.unit;
    heading(formatted("Coefficients: bias [{}], sensitivity [{}]{}", unit,
                      unit_per(unit, c_.sensor.field.unit),
                      uncertainties_.empty() ? "" : "; +- expanded uncertainty U (95 %)"));
    text_ += row("axis", label_width_ + 3, {"bias", "x", "y", "z"});
    const auto all = static_cast<std::size_t>(c_.sensor.response.bias.size());
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(std::min(all, most)); ++k) {
      const double U_bias = half_width(k, ".bias");
      std::vector<std::string> values = {rounded_value(c_.sensor.response.bias(k), U_bias)};
      std::vector<std::string> intervals = {rounded_uncertainty(U_bias)};
      for (Eigen::Index j = 0; j < 3; ++j) {
        const double U = half_width(k, component_of("sensitivity", j));
        values.push_back(rounded_value(c_.sensor.response.sensitivity(k, j), U));
        intervals.push_back(rounded_uncertainty(U));
      }
      text_ += row(axis_name(k), label_width_ + 3, values);
      if (!uncertainties_.empty()) {
        text_ += row(formatted("{:>{}}", "+-", label_width_ + 2), label_width_ + 3, intervals);
      }
    }
    if (all > most) {
      text_ += formatted("  the record contains all {} axes\n", all);
    }
  }

  static std::string in_one_line(std::string lines) {
    constexpr std::string_view goes_on = "\n    ";  // the line break that wrapped() inserts
    for (std::size_t at = lines.find(goes_on); at != std::string::npos; at = lines.find(goes_on)) {
      lines.replace(at, goes_on.size(), " ");
    }
    std::string line;
    for (const std::string_view part : split(lines, '\n')) {
      line += line.empty() || part.empty() ? "" : "; ";
      line += part;
    }
    return line;
  }

  // Adds one line each for noise, misalignment, slope and orientations.
  void add_in_short() {
    const auto m = static_cast<std::size_t>(c_.sensor.response.bias.size());
    constexpr std::size_t few = 3;
    if (m <= few && c_.fit.statistics) {
      std::vector<std::string> noise;
      std::vector<std::string> off;
      for (std::size_t i = 0; i < m; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        noise.push_back(formatted("{:.2g}", statistics_.residual_sd(k)));
        const int nominal = main_axis(c_.sensor.instrument, c_.sensor.response, k);
        const PolarForm polar =
            polar_from_sensitivity(c_.sensor.response.sensitivity.row(k).transpose(), nominal,
                                   c_.sensor.instrument.convention);
        // If no reading has a field along the nominal direction of an axis, the true direction of
        // the axis is unknown.
        const bool is_seen = statistics_.sensitivity_se.rows() <= k ||
                             std::isfinite(statistics_.sensitivity_se(k, nominal));
        off.push_back(is_seen ? formatted("{:.3g}", polar.coning_angle_rad * deg_per_rad)
                              : "not seen");
      }
      const std::string& unit = c_.sensor.instrument.unit;
      text_ += formatted("noise of a reading (standard deviation): {}{}\n", joined(noise),
                         unit == "1" ? "" : " " + unit);
      if (!method_kind(c_.fit.method).by_length) {  // method `faces` does not determine the angles
        text_ +=
            formatted("angles of the axes to their nominal directions: {} degrees\n", joined(off));
      }
    }
    if (c_.fit.levelness) {
      const Levelness& level = *c_.fit.levelness;
      const auto stated = [](double value, double u) {
        return formatted("{} +- {}", rounded_value(1e3 * value, 1e3 * u),
                         rounded_uncertainty(1e3 * u));
      };
      text_ +=
          wrapped(formatted("{}: {} along +x, {} along +y (standard uncertainty); estimates "
                            "from the faces {}",
                            field_kind(c_.sensor.field.kind).vertical
                                ? "slope of the table [mrad]"
                                : "field in the table's plane [1/1000 of the field's magnitude]",
                            stated(level.mean_x, level.standard_error_x),
                            stated(level.mean_y, level.standard_error_y),
                            std::isnan(level.p_value) ? "cannot be compared"
                            : level.consistent        ? "agree"
                                                      : "DISAGREE"),
                  80) +
          "\n";
      if (level.combined) {
        text_ +=
            formatted("{} on the same table: their slopes {} (p = {:.2g})\n",
                      counted(level.combined->slots.size(), "slot"),
                      level.combined->consistent ? "agree" : "DISAGREE", level.combined->p_value);
      }
    }
    if (c_.fit.orientations) {
      const OrientationQuality& quality = *c_.fit.orientations;
      text_ += formatted(
          "fit error {:.3g} % of the field; {:.0f} % of the sphere covered, largest gap {:.0f} "
          "degrees\n",
          100.0 * quality.fit_error, 100.0 * quality.coverage,
          quality.largest_gap_rad * deg_per_rad);
    }
    if (c_.sensor.temperature) {
      text_ += wrapped("coefficients at temperature " +
                           span_text(*c_.sensor.temperature, c_.sensor.instrument.axes,
                                     [](const TemperatureSpan& span) {
                                       return formatted("{:.6g} (valid from {:.6g} to {:.6g})",
                                                        span.reference, span.low, span.high);
                                     }),
                       80) +
               "\n";
    }
  }

  static std::string component_of(const std::string& what, Eigen::Index j) {
    return formatted(".{}.{}", what, "xyz"[j]);
  }

  // Returns the expanded uncertainty of a parameter of axis k, from the scatter of the readings and
  // the uncertainties of the stated inputs. Returns NaN if the uncertainty is unknown.
  // @param what  the parameter's name after the axis, for example ".bias".
  [[nodiscard]] double half_width(Eigen::Index k, const std::string& what) const {
    const std::string name = c_.sensor.instrument.axes[static_cast<std::size_t>(k)] + what;
    const auto at = std::find_if(uncertainties_.begin(), uncertainties_.end(),
                                 [&](const ParameterUncertainty& one) { return one.name == name; });
    return at == uncertainties_.end() ? std::nan("") : at->uncertainty.expanded;
  }

  void add_axes() {
    heading("Sensing axes: size and direction of the sensitivity");
    text_ += row("axis", label_width_ + 3, {"size", "nominal", "coning [deg]", "azimuth [deg]"});
    for (Eigen::Index k = 0; k < c_.sensor.response.bias.size(); ++k) {
      const Eigen::Vector3d S = c_.sensor.response.sensitivity.row(k);
      const int nominal = main_axis(c_.sensor.instrument, c_.sensor.response, k);
      const PolarForm polar = polar_from_sensitivity(S, nominal, c_.sensor.instrument.convention);
      double U = 0.0;
      for (Eigen::Index j = 0; j < 3; ++j) {
        U = std::fmax(U, half_width(k, component_of("sensitivity", j)));
      }
      const double across = S.norm() * std::sin(polar.coning_angle_rad);
      text_ += row(axis_name(k), label_width_ + 3,
                   {rounded_value(S.norm(), U), std::string(1, "xyz"[nominal]),
                    rounded_value(polar.coning_angle_rad * deg_per_rad, U / S.norm() * deg_per_rad),
                    rounded_value(polar.azimuth_rad * deg_per_rad, U / across * deg_per_rad)});
    }
  }

  void add_also() {
    for (const AlsoResponse& also : c_.sensor.also) {
      heading(formatted("Sensitivity to {} along x, y, z [{}]; +- U (95 %)", also.kind,
                        unit_per(c_.sensor.instrument.unit, also.unit)));
      for (Eigen::Index k = 0; k < also.sensitivity.rows(); ++k) {
        std::vector<std::string> values;
        std::vector<std::string> intervals;
        for (Eigen::Index j = 0; j < 3; ++j) {
          const double U = half_width(k, component_of(also.kind, j));
          values.push_back(rounded_value(also.sensitivity(k, j), U));
          intervals.push_back(rounded_uncertainty(U));
        }
        text_ += row(axis_name(k), label_width_ + 3, values);
        text_ += row(formatted("{:>{}}", "+-", label_width_ + 2), label_width_ + 3, intervals);
      }
    }
  }

  // Adds the quantities that are usual for this kind of instrument.
  void add_quantities() {
    const std::vector<KindQuantity> quantities = quantities_of(c_);
    if (quantities.empty()) {
      return;
    }
    heading(formatted("Derived quantities of the {} (+- standard uncertainty)",
                      c_.sensor.instrument.kind));
    for (const KindQuantity& quantity : quantities) {
      std::string name = quantity.name;
      std::replace(name.begin(), name.end(), '_', ' ');
      if (name.ends_with(" deg")) {
        name.resize(name.size() - 4);
      }
      name += quantity.of.empty() ? "" : " " + quantity.of;
      std::string line = formatted("  {}:", name);
      for (std::size_t i = 0; i < quantity.values.size(); ++i) {
        line += " " + rounded_value(quantity.values[i], quantity.u[i]);
        if (std::isfinite(quantity.u[i])) {
          line += " +- " + rounded_uncertainty(quantity.u[i]);
        }
        line += i + 1 < quantity.values.size() ? "," : "";
      }
      line += quantity.unit == "1" ? "" : " " + quantity.unit;
      text_ += formatted("  {}\n", wrapped(line.substr(2), 78));
    }
    if (c_.fit.alignment) {
      const Alignment& alignment = c_.fit.alignment->alignment;
      text_ += wrapped(formatted("  aligned with {}: angle between the two fields {:.3f} degrees "
                                 "(standard error {:.2g}), rotation accurate to {:.2g} degrees",
                                 c_.fit.alignment->record, alignment.angle_rad * deg_per_rad,
                                 alignment.angle_se_rad * deg_per_rad,
                                 alignment.standard_error_rad.maxCoeff() * deg_per_rad),
                       80) +
               "\n";
    }
  }

  void add_orientations() {
    if (!c_.fit.orientations) {
      return;
    }
    const OrientationQuality& quality = *c_.fit.orientations;
    heading("Orientations (f: calibrated reading, F: magnitude of the field)");
    text_ += formatted("  fit error (rms of |f| - F) {:.3g} % of F\n", 100.0 * quality.fit_error);
    text_ += formatted("  standard deviation of the magnitude {:.3g} % of F\n",
                       100.0 * quality.magnitude_spread);
    text_ += formatted("  coverage: {:.0f} % of the sphere within 30 degrees of a reading\n",
                       100.0 * quality.coverage);
    text_ += formatted("  largest gap: {:.0f} degrees, towards {} of the sensor\n",
                       quality.largest_gap_rad * deg_per_rad, direction_in_words(quality.gap));
  }

  void add_levelness() {
    if (!c_.fit.levelness) {
      return;
    }
    const Levelness& levelness = *c_.fit.levelness;
    const bool gravity = field_kind(c_.sensor.field.kind).vertical;
    heading(gravity ? "Levelness: slope of the table [mrad], rising towards +x and +y"
                    : "Field in the table's plane [thousandths of the field's magnitude]");
    const std::size_t width = 40;
    const auto pair = [](double x, double y, double ux, double uy) {
      return std::vector<std::string>{rounded_value(1e3 * x, 1e3 * ux),
                                      rounded_value(1e3 * y, 1e3 * uy)};
    };
    text_ += row("", width, {"x", "y"});
    for (const BlockLevelness& block : levelness.blocks) {
      text_ += row(formatted("block {}", block.block), width,
                   pair(block.x, block.y, block.standard_error_x, block.standard_error_y));
      text_ += row("  standard error", width,
                   {rounded_uncertainty(1e3 * block.standard_error_x),
                    rounded_uncertainty(1e3 * block.standard_error_y)});
    }
    text_ += row("mean", width,
                 pair(levelness.mean_x, levelness.mean_y, levelness.standard_error_x,
                      levelness.standard_error_y));
    text_ += row("standard error of the mean", width,
                 {rounded_uncertainty(1e3 * levelness.standard_error_x),
                  rounded_uncertainty(1e3 * levelness.standard_error_y)});
    if (levelness.estimates.size() > 1) {
      text_ += row(
          formatted("standard deviation of {}", counted(levelness.estimates.size(), "estimate")),
          width,
          {rounded_uncertainty(1e3 * levelness.sd_x), rounded_uncertainty(1e3 * levelness.sd_y)});
    }
    if (!std::isnan(levelness.p_value)) {
      text_ += formatted("  the estimates from the faces {} (p = {:.2g})\n",
                         levelness.consistent ? "agree" : "DISAGREE", levelness.p_value);
    }
    if (levelness.combined) {
      const CombinedLevelness& all = *levelness.combined;
      text_ += row(formatted("all {}", counted(all.slots.size(), "slot")), width,
                   pair(all.x, all.y, all.standard_error_x, all.standard_error_y));
      text_ += row("standard error of all slots", width,
                   {rounded_uncertainty(1e3 * all.standard_error_x),
                    rounded_uncertainty(1e3 * all.standard_error_y)});
      text_ += formatted("  the estimates from the slots {} (p = {:.2g})\n",
                         all.consistent ? "agree" : "DISAGREE", all.p_value);
    }
  }

  // Adds the orientation of each other instrument in the assembly relative to this instrument.
  void add_alignments() {
    if (c_.fit.slot_alignments.empty()) {
      return;
    }
    heading(
        "Rotations of the other instruments relative to this one [mrad], about x, y, z; +- U "
        "(95 %)");
    for (const SlotAlignment& other : c_.fit.slot_alignments) {
      const Eigen::Vector3d turn = rotation_without_quarter_turns(other);
      std::vector<std::string> cells;
      std::vector<std::string> u;
      for (Eigen::Index j = 0; j < 3; ++j) {
        cells.push_back(rounded_value(1e3 * turn(j), 1e3 * other.u_rad(j)));
        u.push_back(rounded_uncertainty(1e3 * other.expanded_rad(j)));
      }
      text_ += row("slot " + other.slot, 20, cells);
      text_ += row("  +-", 20, u);
    }
  }

  void add_quality() {
    if (!c_.fit.statistics) {
      return;
    }
    heading("Fit");
    const std::size_t axes_at_once = 3;
    const auto m = static_cast<std::size_t>(c_.sensor.response.bias.size());
    for (std::size_t first = 0; first < m; first += axes_at_once) {
      add_quality_of(first, std::min(m, first + axes_at_once));
    }
    text_ += formatted("  condition number of the design {:.3g}\n", statistics_.condition_number);
    for (const std::string& words :
         {field_size_sentence(c_), confirmation_sentence(c_), not_counted_sentence(c_)}) {
      text_ += words.empty() ? "" : "\n" + wrapped(words, 80) + "\n";
    }
  }

  void add_quality_of(std::size_t first, std::size_t last) {
    std::vector<std::string> names;
    std::vector<std::string> sd;
    std::vector<std::string> dof;
    std::vector<std::string> unexplained;
    std::vector<std::string> studentized;
    std::vector<std::string> lack;
    for (std::size_t i = first; i < last; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      names.push_back(axis_name(k).substr(0, cell_width - 2));
      sd.push_back(formatted("{:.3g}", statistics_.residual_sd(k)));
      dof.push_back(formatted("{:.4g}", statistics_.degrees_of_freedom(k)));
      const double r_squared = statistics_.r_squared(k);
      unexplained.push_back(std::isnan(r_squared) ? "-" : formatted("{:.1e}", 1.0 - r_squared));
      // With few degrees of freedom, studentised residuals may be very large by chance, so they are
      // not shown.
      constexpr double fewest_degrees_of_freedom = 4.0;
      double largest = std::nan("");
      for (Eigen::Index row = 0; row < statistics_.studentized.rows(); ++row) {
        largest = std::fmax(largest, std::abs(statistics_.studentized(row, k)));
      }
      const bool tells = statistics_.degrees_of_freedom(k) >= fewest_degrees_of_freedom;
      studentized.push_back(tells && !std::isnan(largest) ? formatted("{:.2f}", largest) : "-");
      if (!statistics_.lack_of_fit.empty()) {
        const double p = statistics_.lack_of_fit[i].p_value;
        lack.push_back(std::isnan(p) ? "-" : formatted("{:.2g}", p));
      }
    }
    const std::size_t width = 34;
    text_ += row("axis", width, names);
    text_ +=
        row(formatted("residual sd of a reading [{}]", c_.sensor.instrument.unit).substr(0, width),
            width, sd);
    if (!statistics_.observations_per_axis.empty()) {
      std::vector<std::string> used;
      for (std::size_t i = first; i < last; ++i) {
        used.push_back(std::to_string(statistics_.observations_per_axis[i]));
      }
      text_ += row("readings used", width, used);
    }
    text_ += row("degrees of freedom", width, dof);
    text_ += row("1 - R^2", width, unexplained);
    text_ += row("largest studentised residual", width, studentized);
    if (!lack.empty()) {
      text_ += row("p-value of the lack-of-fit test", width, lack);
    }
  }

  void add_polar_fit() {
    if (c_.fit.polar_fit.empty()) {
      return;
    }
    heading("Fit of the polar form to the same readings (by Gauss-Newton, for comparison)");
    text_ += row("axis", 8, {"bias", "size", "coning [deg]", "azimuth [deg]", "iterations"});
    for (std::size_t k = 0; k < c_.fit.polar_fit.size(); ++k) {
      const PolarFit& fit = c_.fit.polar_fit[k];
      text_ += row(axis_name(static_cast<Eigen::Index>(k)), 8,
                   {formatted("{:.6g}", fit.bias), formatted("{:.6g}", fit.form.sensitivity),
                    formatted("{:.4f}", fit.form.coning_angle_rad * deg_per_rad),
                    formatted("{:.2f}", fit.form.azimuth_rad * deg_per_rad),
                    fit.converged ? std::to_string(fit.rounds) : "none"});
    }
  }

  // Adds the temperature terms b1, c1, ... of bias(t) = b + b1 d + .. and scale(t) = 1 + c1 d + ..
  // Here d = t - t0 is the deviation from the reference temperature t0.
  void add_temperature() {
    if (!c_.sensor.temperature) {
      return;
    }
    const TemperatureResponse& terms = *c_.sensor.temperature;
    heading("Temperature terms; the coefficients above are for temperature " +
            span_text(terms, c_.sensor.instrument.axes, [](const TemperatureSpan& span) {
              return formatted(
                  "{:.6g} (readings at temperatures from {:.6g} to "
                  "{:.6g})",
                  span.reference, span.low, span.high);
            }));
    for (Eigen::Index k = 0; k < terms.bias.rows(); ++k) {
      for (Eigen::Index j = 0; j < terms.bias.cols(); ++j) {
        const std::string power = j == 0 ? "d" : formatted("d^{}", j + 1);
        text_ += row(formatted("{} {}", axis_name(k), power), 20,
                     {"bias", formatted("{:.4g}", terms.bias(k, j)), "scale",
                      formatted("{:.4g}", terms.scale(k, j))});
        text_ += row("", 20,
                     {"+- (1 sd)", formatted("{:.1g}", terms.bias_se(k, j)), "",
                      formatted("{:.1g}", terms.scale_se(k, j))});
      }
    }
  }

  [[nodiscard]] std::string axis_name(Eigen::Index k) const {
    return c_.sensor.instrument.axes[static_cast<std::size_t>(k)].substr(0, longest_label);
  }

  const Calibration& c_;
  const FitStatistics blank_;  // used if the record has no statistics, e.g. from other software
  const FitStatistics& statistics_;
  std::vector<ParameterUncertainty> uncertainties_;
  std::size_t label_width_ = 4;
  std::string text_;
};

}  // namespace

std::string verdict_sentence(const Calibration& calibration) {
  if (calibration.findings.status == CalibrationStatus::refused) {
    return "Refused: do not use this calibration.";
  }
  if (calibration.findings.verdict && !calibration.findings.verdict->passed) {
    return "The unit does not meet its limits.";
  }
  if (calibration.findings.confirmation && !calibration.findings.confirmation->passed) {
    return "Calibrated, but the confirmation readings contradict the fit.";
  }
  if (!calibration.fit.statistics) {
    return "The record contains only coefficients, without readings to test them.";
  }
  const std::size_t warnings = calibration.findings.warnings.size();
  const std::string limits = calibration.findings.verdict ? ", and the limits are met" : "";
  return calibration.findings.status == CalibrationStatus::warning
             ? formatted("Calibrated{}, with {} to look at.", limits,
                         warnings == 1 ? "one thing" : formatted("{} things", warnings))
         : limits.empty() ? "Calibrated. No problems found."
                          : formatted("Calibrated{}.", limits);
}

std::string field_size_sentence(const Calibration& calibration) {
  if (!calibration.fit.field_size) {
    return "";
  }
  const FieldSizeCheck& check = *calibration.fit.field_size;
  const auto parts = [](double relative) {
    const double ppm = 1e6 * relative;
    return relative >= 1e-3 ? formatted("{} %", number_text(1e2 * relative, 2))
                            : formatted("{} ppm", number_text(ppm < 10.0 ? ppm : std::round(ppm),
                                                              ppm < 10.0 ? 2 : 4));
  };
  constexpr double unlikely = 0.01;
  constexpr double next_to_nothing = 1e-6;  // a smaller effect is only rounding
  return formatted(
      "The measured value of {} scatters over {} orientations by {}; the noise of the readings "
      "explains {}{}{}.",
      field_kind(calibration.sensor.field.kind).vertical ? "g" : "the field's magnitude",
      check.orientations, parts(check.relative_sd), parts(check.by_noise),
      check.by_inputs > next_to_nothing * check.by_noise
          ? formatted(", and the stated uncertainty of cube and table explains {}",
                      parts(check.by_inputs))
          : ", and the angles of the cube's faces are not stated",
      check.p_value < unlikely
          ? formatted("; the rest is unexplained (p = {})", number_text(check.p_value, 1))
          : "");
}

std::string confirmation_sentence(const Calibration& calibration) {
  if (!calibration.findings.confirmation) {
    return "";
  }
  const Confirmation& confirmation = *calibration.findings.confirmation;
  const std::size_t count = confirmation.readings.size();
  std::vector<int> outside;
  for (const ConfirmationReading& reading : confirmation.readings) {
    if (!reading.within) {
      outside.push_back(reading.run);
    }
  }
  return formatted(
      "Confirmation: {} kept out of the fit {} (p = {}){}.",
      count == 1 ? "the reading" : formatted("the {} readings", count),
      confirmation.passed ? count == 1 ? "agrees with it" : "agree with it" : "CONTRADICT it",
      number_text(confirmation.p_value, 2),
      outside.empty()
          ? ", each within its 95 % interval"
          : formatted("; outside the 95 % interval of an axis: {}", name_of_runs(outside)));
}

std::string summary(const Calibration& calibration, SummaryDetail detail, SummaryEnd end) {
  Summary of(calibration);
  std::string text = detail == SummaryDetail::brief ? of.brief() : of.text();
  if (end == SummaryEnd::findings) {
    for (const CalibrationWarning& warning : calibration.findings.warnings) {
      text += formatted("warning: {}\n", warning.message);
    }
    text += verdict_sentence(calibration) + "\n";
  }
  return text;
}

}  // namespace axiscal
