// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/fitted_parameters.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "axiscal/calib/calibration_json.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/not_a_number.hpp"
#include "calib/record/parameter_names.hpp"
#include "core/json_pieces.hpp"

namespace axiscal {
namespace {

// Returns the standard uncertainties of the parameters `names`. The result is NaN for each
// parameter that is absent from `of`.
// @param of  names of the parameters to which `variances` belong; may be empty.
Eigen::VectorXd uncertainties(const std::vector<std::string>& of,
                              const Eigen::VectorXd& variances,
                              const std::vector<std::string>& names) {
  Eigen::VectorXd u(static_cast<Eigen::Index>(names.size()));
  std::size_t next = 0;  // index in `of`; most records have the same order as `names`
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (next >= of.size() || of[next] != names[i]) {
      next = static_cast<std::size_t>(std::find(of.begin(), of.end(), names[i]) - of.begin());
    }
    const auto at = static_cast<Eigen::Index>(next);
    u(static_cast<Eigen::Index>(i)) =
        next < of.size() && at < variances.size() ? std::sqrt(variances(at)) : not_a_number;
    ++next;
  }
  return u;
}

Eigen::VectorXd in_order(const Eigen::VectorXd& bias, const Eigen::MatrixXd& sensitivity) {
  Eigen::MatrixXd by_axis(4, bias.size());
  by_axis << bias.transpose(), sensitivity.transpose();
  return by_axis.reshaped();
}

FittedParameters fitted_parameters(const Calibration& calibration) {
  const Instrument& instrument = calibration.sensor.instrument;
  const LinearResponse& response = calibration.sensor.response;
  return {.date = calibration.provenance.date(),
          .serial = instrument.serial,
          .axes = instrument.axes,
          .values = in_order(response.bias, response.sensitivity),
          .u = uncertainties(
              calibration.fit.statistics ? calibration.fit.statistics->parameter_names
                                         : std::vector<std::string>(),
              parameter_covariance(calibration).diagonal(), parameter_names(instrument.axes))};
}

bool are_good(const std::vector<std::string>& axes) {
  try {
    check_axes({.axes = axes});
    return true;
  } catch (const DomainError&) {
    return false;
  }
}

// Returns the sum of the variances from all type B sources of the budget. Returns nullopt if the
// sources have a form that only parse_calibration() can read.
std::optional<Eigen::VectorXd> variances_of_sources(std::string_view sources, Eigen::Index size) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(size);
  if (sources.empty()) {
    return sum;
  }
  const auto list = list_of_piece(sources);
  if (!list) {
    return std::nullopt;
  }
  for (const std::string_view source : *list) {
    const auto pieces =
        json_pieces(source, std::array<std::string_view, 2>{"/type", "/covariance"});
    if (!pieces) {
      return std::nullopt;
    }
    const auto& [type, own] = *pieces;
    const auto plain_type = text_of_piece(type);
    if (plain_type == "A") {
      continue;  // the source is the fit, whose covariance is in the statistics
    }
    const auto covariance = matrix_of_piece(own, size, size);
    if (!plain_type || !covariance || !covariance->allFinite()) {
      return std::nullopt;
    }
    sum += covariance->diagonal();
  }
  return sum;
}

// Reads a record in the form that this program writes. Returns nullopt if the record has another
// form, which only parse_calibration() can read.
std::optional<FittedParameters> quickly_read(std::string_view text) {
  static constexpr std::array<std::string_view, 11> members = {"/format",
                                                               "/version",
                                                               "/created",
                                                               "/measured",
                                                               "/instrument/serial",
                                                               "/instrument/axes",
                                                               "/coefficients/bias",
                                                               "/coefficients/sensitivity",
                                                               "/statistics/parameter_names",
                                                               "/statistics/covariance",
                                                               "/uncertainty/sources"};
  const auto pieces = json_pieces(text, members);
  if (!pieces) {
    return std::nullopt;
  }
  const auto& [format, version, created, measured, whose, which, bias, sensitivity, names,
               covariance, sources] = *pieces;
  if (format != "\"axiscal-calibration\"" || (version != "1" && version != "2")) {
    return std::nullopt;
  }
  auto date = text_of_piece(measured.empty() ? created : measured);
  auto serial = whose.empty() ? std::optional<std::string>("") : text_of_piece(whose);
  auto axes = texts_of_piece(which);
  const auto parameters = texts_of_piece(names);
  if (!date || !serial || !axes || !are_good(*axes) || !parameters) {
    return std::nullopt;
  }
  const auto m = static_cast<Eigen::Index>(axes->size());
  const auto count = static_cast<Eigen::Index>(parameters->size());
  const auto b = vector_of_piece(bias, m);
  const auto S = matrix_of_piece(sensitivity, m, 3);
  const auto of_fit = matrix_of_piece(covariance, count, count);
  const auto of_sources = variances_of_sources(sources, count);
  if (!b || !S || !b->allFinite() || !S->allFinite() || !of_fit || !of_sources) {
    return std::nullopt;
  }
  Eigen::VectorXd u =
      uncertainties(*parameters, of_fit->diagonal() + *of_sources, parameter_names(*axes));
  return FittedParameters{.date = *std::move(date),
                          .serial = *std::move(serial),
                          .axes = *std::move(axes),
                          .values = in_order(*b, *S),
                          .u = std::move(u)};
}

}  // namespace

FittedParameters parse_fitted_parameters(std::string_view text, const std::string& name) {
  std::optional<FittedParameters> quick = quickly_read(text);
  return quick ? *std::move(quick) : fitted_parameters(parse_calibration(text, name));
}

}  // namespace axiscal
