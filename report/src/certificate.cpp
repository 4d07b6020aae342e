// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "axiscal/calib/intrinsic.hpp"
#include "axiscal/calib/method_kind.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "axiscal/core/rounded_value.hpp"
#include "axiscal/core/units.hpp"
#include "axiscal/exchange/export.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/pdf_archive.hpp"
#include "report/src/pdf_writer.hpp"

namespace axiscal {
#ifdef AXISCAL_CAIRO
namespace {

std::string or_not_stated(const std::string& text) {
  return text.empty() ? "not stated" : text;
}

std::string block_of(const CertificateParty& party) {
  return or_not_stated(party.name) + (party.address.empty() ? "" : ", " + joined(party.address)) +
         (party.accreditation.empty() ? "" : "; accreditation " + party.accreditation);
}

// Returns the name of a parameter for a certificate.
std::string words_of_parameter(const std::string& name) {
  const std::vector<std::string_view> parts = split(name, '.');
  const auto order = [](std::string_view term) {  // for example "d" or "d2"
    return term == "d" ? std::string("temperature")
                       : formatted("temperature to the power {}", term.substr(1));
  };
  if (parts.size() == 3 && parts[0] == "angle") {
    return formatted("angle between {} and {}", parts[1], parts[2]);
  }
  if (parts.size() == 2 && parts[1] == "bias") {
    return formatted("bias of {}", parts[0]);
  }
  if (parts.size() == 2 && parts[1] == "sensitivity") {
    return formatted("sensitivity of {}", parts[0]);
  }
  if (parts.size() == 3 && parts[1] == "sensitivity") {
    return formatted("sensitivity of {} along {}", parts[0], parts[2]);
  }
  if (parts.size() == 2 && parts[1] == "residual_sd") {
    return formatted("scatter of {}", parts[0]);
  }
  if (parts.size() == 2 && parts[0] == "levelness") {
    return formatted("slope of the table along {}", parts[1]);
  }
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> others = {
      {{"readings", "number of readings"},
       {"design_points", "number of orientations"},
       {"pitch_error_deg", "uncertainty of pitch"},
       {"drift_p_value", "p value of the test for drift"}}};
  for (const auto& [known, words] : others) {
    if (name == known) {
      return std::string(words);
    }
  }
  if (parts.size() == 3 && parts[2].starts_with('d') &&
      (parts[1] == "bias" || parts[1] == "scale")) {
    return formatted("{} of {} with {}", parts[1], parts[0], order(parts[2]));
  }
  return name;
}

std::vector<std::string> row_of(const std::string& name,
                                double value,
                                const CombinedUncertainty& uncertainty,
                                const std::string& unit) {
  return {words_of_parameter(name), typographic_minus(rounded_value(value, uncertainty.expanded)),
          rounded_uncertainty(uncertainty.expanded), number_text(uncertainty.coverage_factor, 3),
          unit};
}

std::vector<std::vector<std::string>> coefficient_rows(const Calibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const ParameterUncertainty& one : parameter_uncertainties(calibration)) {
    rows.push_back(
        row_of(one.name, one.value, one.uncertainty, parameter_unit(calibration, one.name)));
  }
  return rows;
}

std::vector<std::vector<std::string>> intrinsic_rows(const Calibration& calibration) {
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < intrinsic.uncertainty.size(); ++i) {
    const std::string& name = intrinsic.names[i];
    const double value = intrinsic.values(static_cast<Eigen::Index>(i));
    if (name.ends_with(".bias")) {
      continue;  // the table above contains the biases
    }
    if (!name.starts_with("angle.")) {
      rows.push_back(
          row_of(name, value, intrinsic.uncertainty[i],
                 unit_per(calibration.sensor.instrument.unit, calibration.sensor.field.unit)));
      continue;
    }
    CombinedUncertainty in_degrees = intrinsic.uncertainty[i];
    in_degrees.expanded *= deg_per_rad;
    rows.push_back(row_of(name, value * deg_per_rad, in_degrees, "deg"));
  }
  return rows;
}

std::string method_text(const Calibration& calibration) {
  std::string text;
  if (method_kind(calibration.fit.method).by_magnitude) {
    text =
        "The instrument was read in many orientations in a field of known magnitude. Bias and "
        "sensitivity are the values for which the calibrated readings have that magnitude. The "
        "results are in the instrument's own frame.";
  } else if (method_kind(calibration.fit.method).by_turns) {
    text =
        "The gyroscope was turned between rests. Bias and sensitivity are the values for which the "
        "integrated rates of each turn agree with the attitudes before and after it.";
  } else {
    text = formatted(
        "The instrument was read in known orientations relative to the reference field. Bias and "
        "sensitivities to the field's components result from a linear regression: {}. The "
        "sensitivities are in the frame of the positioner.",
        method_kind(calibration.fit.method).words);
  }
  return formatted("{} {}{} were used. Model: reading = bias + sensitivity times field.", text,
                   calibration.fit.statistics->observations,
                   method_kind(calibration.fit.method).by_turns ? " turns" : " readings");
}

// Returns the expanded uncertainties of coefficients, sensitivities and angles between axes, with
// the parameter's name as the key.
std::map<std::string, double, std::less<>> expanded_uncertainties(const Calibration& calibration) {
  std::map<std::string, double, std::less<>> expanded;
  for (const ParameterUncertainty& one : parameter_uncertainties(calibration)) {
    expanded[one.name] = one.uncertainty.expanded;
  }
  const IntrinsicParameters intrinsic = intrinsic_parameters(calibration);
  for (std::size_t i = 0; i < intrinsic.uncertainty.size(); ++i) {
    expanded.emplace(intrinsic.names[i], intrinsic.uncertainty[i].expanded);
  }
  return expanded;
}

// Returns the unit of a limit in a certificate, and the factor from the record's unit to that unit.
// Angles are in degrees.
std::pair<std::string, double> unit_of_limit(const Calibration& calibration,
                                             const std::string& name) {
  if (name.starts_with("angle.") || name.starts_with("levelness.")) {
    return {"deg", deg_per_rad};
  }
  if (name == "pitch_error_deg") {
    return {"deg", 1.0};
  }
  if (name == "readings" || name == "design_points" || name == "drift_p_value") {
    return {"1", 1.0};
  }
  const Instrument& instrument = calibration.sensor.instrument;
  if (name.ends_with(".residual_sd")) {
    return {instrument.unit, 1.0};
  }
  return {name.ends_with(".sensitivity") ? unit_per(instrument.unit, calibration.sensor.field.unit)
                                         : parameter_unit(calibration, name),
          1.0};
}

// Returns one row of a table for each limit. The columns are: value, U, unit, low limit, high
// limit, verdict. For a decision rule with a guard band, a further column before the verdict states
// the accepted range.
std::vector<std::vector<std::string>> limit_rows(const Calibration& calibration,
                                                 const Verdict& verdict) {
  const auto all = expanded_uncertainties(calibration);
  std::vector<std::vector<std::string>> rows;
  for (const LimitVerdict& limit : verdict.limits) {
    const auto [unit, factor] = unit_of_limit(calibration, limit.parameter);
    const auto known = all.find(limit.parameter);
    const double expanded = factor * (known != all.end()       ? known->second
                                      : limit.guard_band > 0.0 ? limit.guard_band
                                                               : std::nan(""));
    const auto bound = [&, factor = factor](const std::optional<double>& value, double guard) {
      if (!value) {
        return std::string("none");
      }
      const double at = factor * (*value + guard);
      return typographic_minus(guard == 0.0 || std::isnan(expanded) ? number_text(at, 6)
                                                                    : rounded_value(at, expanded));
    };
    std::vector<std::string> row = {
        words_of_parameter(limit.parameter),
        typographic_minus(rounded_value(factor * limit.value, expanded)),
        rounded_uncertainty(expanded),
        unit,
        bound(limit.low, 0.0),
        bound(limit.high, 0.0)};
    if (verdict.rule == "guarded") {
      const std::string low = bound(limit.low, limit.guard_band);
      const std::string high = bound(limit.high, -limit.guard_band);
      row.push_back(!limit.low    ? "at most " + high
                    : !limit.high ? "at least " + low
                                  : formatted("{} to {}", low, high));
    }
    row.emplace_back(limit.passed ? "pass" : "fail");
    rows.push_back(std::move(row));
  }
  return rows;
}

std::string decision_rule_of(const CertificateDetails& details, const Verdict& verdict) {
  if (!details.decision_rule.empty()) {
    return details.decision_rule;
  }
  return verdict.rule == "guarded"
             ? "Guarded acceptance (JCGM 106:2012): a value passes if it lies within the limits "
               "narrowed by its expanded uncertainty."
             : "Simple acceptance (JCGM 106:2012): a value passes if it lies within the limits; "
               "its uncertainty is not taken into account.";
}

// Writes the facts about laboratory, customer, instrument, method and reference.
void write_facts(const Calibration& calibration,
                 const CertificateDetails& details,
                 PdfPages& pages) {
  const Instrument& instrument = calibration.sensor.instrument;
  const FieldDescription& field = calibration.sensor.field;
  std::vector<std::string> pictures;
  for (const std::string& path : {details.laboratory.logo, details.laboratory.mark}) {
    if (!path.empty()) {
      pictures.push_back(path);
    }
  }
  pages.pictures(pictures);
  pages.title("Calibration certificate");
  pages.facts(
      {{"Certificate number", or_not_stated(details.number)},
       {"Laboratory", block_of(details.laboratory)},
       {"Customer", block_of(details.customer)},
       {"Place of calibration", details.place.empty() ? "the laboratory" : details.place},
       {"Item received", or_not_stated(details.received)},
       {"Calibrated", details.calibrated.empty() ? or_not_stated(calibration.provenance.date())
                                                 : details.calibrated},
       {"Issued", or_not_stated(details.issued)}});
  pages.heading("Item");
  pages.facts({{"Instrument", formatted("{}, axes {}, readings in {}", instrument.kind,
                                        joined(instrument.axes), instrument.unit)},
               {"Manufacturer", details.manufacturer},
               {"Model", details.model},
               {"Serial number", or_not_stated(instrument.serial)},
               {"Condition", or_not_stated(details.condition)}});
  pages.heading("Method and conditions");
  pages.paragraph(method_text(calibration));
  std::string reference =
      formatted("{}, {} {}", field.kind, number_text(field.magnitude, 8), field.unit);
  reference +=
      field.magnitude_u > 0.0 ? ", standard uncertainty " + number_text(field.magnitude_u, 2) : "";
  reference += field.model.empty() ? "" : ", model " + field.model;
  pages.facts({{"Procedure", details.procedure},
               {"Reference field", reference},
               {"Positioner", calibration.provenance.positioner.empty()
                                  ? "nominal cube"
                                  : calibration.provenance.positioner},
               {"Environment", or_not_stated(details.environment)},
               {"Software", calibration.provenance.software}});
  pages.heading("Metrological traceability");
  if (details.traceability.empty()) {
    pages.paragraph("not stated");
  }
  for (const std::string& statement : details.traceability) {
    pages.paragraph(statement);
  }
  if (const std::vector<std::string> missing = not_counted(calibration); !missing.empty()) {
    pages.paragraph(formatted("The stated uncertainties do not include the uncertainty of: {}.",
                              joined(missing)));
  }
  if (!counts_magnitude(calibration)) {
    pages.paragraph(formatted(
        "The results are relative to the field at the place of calibration, whose magnitude is "
        "taken as exactly {} {}; no claim in SI units is made.",
        number_text(field.magnitude, 8), field.unit));
  }
}

void write_results(const Calibration& calibration, PdfPages& pages) {
  pages.heading("Results");
  const std::vector<std::string> head = {"quantity", "value", "U", "k", "unit"};
  pages.table("", head, coefficient_rows(calibration));
  pages.table("Independent of the mounting: magnitudes of sensitivity, angles between axes", head,
              intrinsic_rows(calibration));
  if (calibration.sensor.temperature) {
    const TemperatureResponse& over = *calibration.sensor.temperature;
    pages.paragraph(formatted(
        "Coefficients at temperature {}. A coefficient \"with temperature\" multiplies the "
        "difference from this temperature, or the stated power of this difference{}.",
        span_text(over, calibration.sensor.instrument.axes,
                  [](const TemperatureSpan& span) {
                    return formatted("{} (valid from {} to {})", number_text(span.reference, 6),
                                     number_text(span.low, 6), number_text(span.high, 6));
                  }),
        over.has_own_sensors() ? "; each axis is corrected with the temperature of its own sensor"
                               : ""));
  }
}

void write_uncertainty(const Calibration& calibration,
                       const CertificateDetails& details,
                       PdfPages& pages) {
  pages.heading("Uncertainty of measurement");
  pages.paragraph(
      "U is the expanded uncertainty: the combined standard uncertainty multiplied by the coverage "
      "factor k, which for a t distribution with the effective degrees of freedom corresponds to a "
      "coverage probability of about 95 %. It was evaluated by JCGM 100:2008 (GUM).");
  std::vector<std::string> sources;
  if (calibration.fit.uncertainty) {
    for (const UncertaintySource& source : calibration.fit.uncertainty->sources) {
      sources.push_back(formatted("{} (type {})", source.name, source.type));
    }
    pages.paragraph(formatted("Sources: {}.", joined(sources)));
  }
  if (calibration.findings.verdict) {
    pages.heading("Statement of conformity");
    pages.paragraph(decision_rule_of(details, *calibration.findings.verdict));
    const bool is_guarded = calibration.findings.verdict->rule == "guarded";
    std::vector<std::string> head = {"quantity", "value", "U", "unit", "low", "high", "verdict"};
    if (is_guarded) {
      head.insert(head.end() - 1, "accepted");
    }
    pages.table("", head, limit_rows(calibration, *calibration.findings.verdict));
    if (is_guarded) {
      pages.paragraph("A quantity without U is compared with its limits without a guard band.");
    }
    pages.paragraph(calibration.findings.verdict->passed
                        ? "The item meets the limits above."
                        : "The item does not meet the limits above.");
  }
}

void write_remarks(const Calibration& calibration,
                   const CertificateDetails& details,
                   PdfPages& pages) {
  std::vector<std::string> remarks = details.remarks;
  for (const Correction& correction : calibration.findings.corrections) {
    remarks.push_back("Deviation from the procedure: readings were corrected: " +
                      correction.message);
  }
  for (const CalibrationWarning& warning : calibration.findings.warnings) {
    remarks.push_back("Observation: " + warning.message);
  }
  if (!remarks.empty()) {
    pages.heading("Remarks");
    for (const std::string& remark : remarks) {
      pages.paragraph(remark);
    }
  }
}

void write_certificate(const Calibration& calibration,
                       const CertificateDetails& details,
                       PdfPages& pages) {
  write_facts(calibration, details, pages);
  write_results(calibration, pages);
  write_uncertainty(calibration, details, pages);
  write_remarks(calibration, details, pages);
  pages.heading("Statements");
  pages.paragraph(
      "The results relate only to the item calibrated, in its condition at the time of "
      "calibration. This "
      "certificate shall not be reproduced except in full without approval of the laboratory.");
  for (const InputFileDigest& input : calibration.provenance.inputs) {
    pages.paragraph(formatted("Readings: {}{}", input.path,
                              input.sha256.empty() ? "" : ", SHA-256 " + input.sha256));
  }
  pages.heading("Authorised by");
  if (details.authorised.empty()) {
    pages.paragraph("not stated");
  }
  pages.signature_lines(details.authorised);
  pages.centred("\u2013 end of the certificate \u2013");
}

}  // namespace
#endif

std::vector<std::string> missing_details(const Calibration& calibration,
                                         const CertificateDetails& details) {
  std::vector<std::string> missing;
  const auto need = [&](bool stated, const char* what) {
    if (!stated) {
      missing.emplace_back(what);
    }
  };
  need(!details.number.empty(), "number");
  need(!details.laboratory.name.empty() && !details.laboratory.address.empty(),
       "laboratory (name, address)");
  need(!details.customer.name.empty(), "customer (name)");
  need(!calibration.sensor.instrument.serial.empty(), "the instrument's serial number");
  need(!details.condition.empty(), "condition");
  const std::string& measured = calibration.provenance.measured;
  need(measured.empty() || details.calibrated.empty() ||
           measured.substr(0, 10) == details.calibrated.substr(0, 10),
       "calibrated (the stated date differs from the date of the readings; leave the entry out)");
  need(!details.issued.empty(), "issued");
  need(!details.environment.empty(), "environment");
  need(!details.traceability.empty(), "traceability");
  need(!details.authorised.empty(), "authorised");
  need(counts_magnitude(calibration),
       "the standard uncertainty of the field's magnitude (required for a claim in SI units)");
  return missing;
}

#ifdef AXISCAL_CAIRO
namespace {

// Returns the digital calibration certificate (DCC). Its content is empty if the DCC cannot be made
// from this record or by this build.
PdfAttachment dcc_of(const Calibration& calibration, const CertificateDetails& details) {
  try {
    return {.name = "certificate-dcc.xml",
            .description = "Digital Calibration Certificate (DCC) of the same results",
            .type = "text/xml",
            .content = export_calibration(calibration, "dcc", {.laboratory = details}).content};
  } catch (const Error&) {
    return {};
  }
}

}  // namespace
#endif

std::string certificate_pdf(const Calibration& calibration,
                            [[maybe_unused]] const CertificateDetails& details) {
  check_certifiable(calibration);
#ifdef AXISCAL_CAIRO
  const bool is_draft = !missing_details(calibration, details).empty();
  const std::string header = formatted(
      "{}Calibration certificate {}{}", is_draft ? "DRAFT: " : "", or_not_stated(details.number),
      details.laboratory.name.empty() ? "" : ", " + details.laboratory.name);
  const std::string pdf =
      pdf_of({.title = header, .header = header, .watermark = is_draft ? "DRAFT" : ""},
             [&](PdfPages& pages) { write_certificate(calibration, details, pages); });
  return archived_pdf(pdf, header, dcc_of(calibration, details));
#else
  throw DomainError("this build does not support PDF: it was built without cairo and pango");
#endif
}

}  // namespace axiscal
