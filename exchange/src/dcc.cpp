// SPDX-License-Identifier: Apache-2.0
// Format dcc: the Digital Calibration Certificate (PTB, schema 3.2.1) with quantities of D-SI 1.3.
#ifdef AXISCAL_PUGIXML
#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>
#include <sstream>
#include <utility>

#include "axiscal/calib/settings.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "exchange/src/consumer.hpp"
#include "exchange/src/formats.hpp"

namespace axiscal {
namespace {

using pugi::xml_node;

xml_node child(xml_node parent, const char* name) {
  return parent.append_child(name);
}

// Makes a text valid for XML and for the schema. Control characters become blanks, and blanks at
// both ends are removed.
std::string plain(const std::string& value) {
  std::string safe = value;
  std::replace_if(
      safe.begin(), safe.end(),
      [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
  return std::string(trimmed(safe));
}

void text(xml_node parent, const char* name, const std::string& value) {
  child(parent, name).text().set(plain(value).c_str());
}

bool is_capital(char c) {
  return c >= 'A' && c <= 'Z';
}

// Returns true if a text has the form of a date, for example "2026-11-21".
bool is_date(const std::string& text) {
  constexpr std::string_view form = "dddd-dd-dd";
  return text.size() == form.size() &&
         std::equal(text.begin(), text.end(), form.begin(), [](char c, char wanted) {
           return wanted == 'd' ? c >= '0' && c <= '9' : c == wanted;
         });
}

// Adds the element `name`, which contains the text in a `dcc:content` element.
void content(xml_node parent, const char* name, const std::string& value) {
  text(child(parent, name), "dcc:content", value);
}

struct Unit {
  std::string_view name;
  std::string_view si;       ///< the unit in the notation of D-SI
  std::string_view inverse;  ///< reciprocal unit in the notation of D-SI
};

constexpr std::array units = {
    Unit{"1", "\\one", "\\one"},
    Unit{"V", "\\volt", "\\volt\\tothe{-1}"},
    Unit{"mV", "\\milli\\volt", "\\milli\\volt\\tothe{-1}"},
    Unit{"A", "\\ampere", "\\ampere\\tothe{-1}"},
    Unit{"mA", "\\milli\\ampere", "\\milli\\ampere\\tothe{-1}"},
    Unit{"m/s^2", "\\metre\\second\\tothe{-2}", "\\metre\\tothe{-1}\\second\\tothe{2}"},
    Unit{"rad/s", "\\radian\\second\\tothe{-1}", "\\radian\\tothe{-1}\\second"},
    Unit{"deg/s", "\\degree\\second\\tothe{-1}", "\\degree\\tothe{-1}\\second"},
    Unit{"T", "\\tesla", "\\tesla\\tothe{-1}"},
    Unit{"mT", "\\milli\\tesla", "\\milli\\tesla\\tothe{-1}"},
    Unit{"uT", "\\micro\\tesla", "\\micro\\tesla\\tothe{-1}"},
    Unit{"nT", "\\nano\\tesla", "\\nano\\tesla\\tothe{-1}"},
    Unit{"W/m^2", "\\watt\\metre\\tothe{-2}", "\\watt\\tothe{-1}\\metre\\tothe{2}"},
};

const Unit* find_unit(const std::string& name) {
  for (const Unit& unit : units) {
    if (unit.name == name) {
      return &unit;
    }
  }
  return nullptr;
}

// Returns the name of a coefficient's unit in D-SI notation. If D-SI has no such unit (counts, g),
// returns `\one` and writes the unit to `remark`.
std::string si_unit(const Calibration& calibration,
                    bool of_reading,
                    bool per_field,
                    std::string& remark) {
  const Unit* const reading = find_unit(calibration.sensor.instrument.unit);
  const Unit* const field = find_unit(calibration.sensor.field.unit);
  if ((of_reading && reading == nullptr) || (per_field && field == nullptr)) {
    const std::string unit = of_reading ? calibration.sensor.instrument.unit : "1";
    remark = formatted(" [{}]", per_field ? unit_per(unit, calibration.sensor.field.unit) : unit);
    return "\\one";
  }
  std::string unit = of_reading && reading->name != "1" ? std::string(reading->si) : "";
  if (per_field && field->name != "1") {
    unit += field->inverse;
  }
  return unit.empty() ? "\\one" : unit;
}

void add_contact(xml_node parent,
                 const char* name,
                 const CertificateParty& party,
                 const std::string& country) {
  xml_node contact = child(parent, name);
  content(contact, "dcc:name", party.name);
  xml_node location = child(contact, "dcc:location");
  if (!country.empty()) {
    text(location, "dcc:countryCode", country);
  }
  for (const std::string& line : party.address) {
    content(location, "dcc:further", line);
  }
}

// Returns the details of the certificate for which the schema has no element, as statements.
std::vector<std::string> statements_of(const CertificateDetails& details) {
  std::vector<std::string> all = details.traceability;
  const auto say = [&](const char* what, const std::string& text) {
    if (!plain(text).empty()) {
      all.push_back(formatted("{}: {}", what, text));
    }
  };
  say("Accreditation", details.laboratory.accreditation);
  say("Place of calibration", details.place);
  say("Condition of the item", details.condition);
  say("Decision rule", details.decision_rule);
  for (const std::string& remark : details.remarks) {
    say("Remark", remark);
  }
  return all;
}

void add_administration(xml_node root,
                        const Calibration& calibration,
                        const CertificateDetails& details) {
  xml_node data = child(root, "dcc:administrativeData");
  xml_node software = child(child(data, "dcc:dccSoftware"), "dcc:software");
  const std::size_t blank = calibration.provenance.software.find(' ');
  content(software, "dcc:name", calibration.provenance.software.substr(0, blank));
  text(software, "dcc:release",
       blank == std::string::npos ? "unknown" : calibration.provenance.software.substr(blank + 1));
  xml_node core = child(data, "dcc:coreData");
  const std::string performed =
      details.calibrated.empty() ? calibration.provenance.date().substr(0, 10) : details.calibrated;
  text(core, "dcc:countryCodeISO3166_1", details.country);
  text(core, "dcc:usedLangCodeISO639_1", "en");
  text(core, "dcc:mandatoryLangCodeISO639_1", "en");
  text(core, "dcc:uniqueIdentifier", details.number);
  if (!details.received.empty()) {
    text(core, "dcc:receiptDate", details.received);
  }
  text(core, "dcc:beginPerformanceDate", performed);
  text(core, "dcc:endPerformanceDate", performed);
  text(core, "dcc:performanceLocation", details.place.empty() ? "laboratory" : "other");
  if (!details.issued.empty()) {
    text(core, "dcc:issueDate", details.issued);
  }
  xml_node item = child(child(data, "dcc:items"), "dcc:item");
  content(item, "dcc:name", calibration.sensor.instrument.kind);
  if (!details.manufacturer.empty()) {
    content(child(item, "dcc:manufacturer"), "dcc:name", details.manufacturer);
  }
  if (!plain(details.model).empty()) {
    text(item, "dcc:model", details.model);
  }
  xml_node identification = child(child(item, "dcc:identifications"), "dcc:identification");
  text(identification, "dcc:issuer", "manufacturer");
  text(identification, "dcc:value", calibration.sensor.instrument.serial);
  content(identification, "dcc:name", "serial number");
  add_contact(child(data, "dcc:calibrationLaboratory"), "dcc:contact", details.laboratory,
              details.country);
  xml_node persons = child(data, "dcc:respPersons");
  for (const auto& [name, function] : details.authorised) {
    xml_node person = child(persons, "dcc:respPerson");
    content(child(person, "dcc:person"), "dcc:name", name);
    if (!plain(function).empty()) {
      text(person, "dcc:role", function);
    }
    text(person, "dcc:mainSigner", "true");
  }
  add_contact(data, "dcc:customer", details.customer, "");
  const std::vector<std::string> said = statements_of(details);
  if (!said.empty()) {
    xml_node statements = child(data, "dcc:statements");
    for (const std::string& statement : said) {
      content(child(statements, "dcc:statement"), "dcc:declaration", statement);
    }
  }
}

// The reference temperature of a parameter such as "y.bias.d".
double reference_of(const Calibration& calibration, const std::string& parameter) {
  const std::vector<std::string>& axes = calibration.sensor.instrument.axes;
  const auto axis = std::find_if(axes.begin(), axes.end(), [&](const std::string& name) {
    return parameter.starts_with(name + ".");
  });
  return calibration.sensor.temperature->span_of(axis - axes.begin()).reference;
}

void add_quantity(xml_node list, const Calibration& calibration, const ParameterUncertainty& one) {
  const bool is_bias = one.name.find(".bias") != std::string::npos;
  const bool is_scale = one.name.find(".scale") != std::string::npos;
  const std::size_t power = one.name.find(".d");
  std::string remark;
  const std::string unit = si_unit(calibration, !is_scale, !is_bias && !is_scale, remark);
  if (power != std::string::npos) {
    remark += formatted(" per {}, d = temperature - {}", one.name.substr(power + 1),
                        number_text(reference_of(calibration, one.name)));
  }
  xml_node quantity = child(list, "dcc:quantity");
  content(quantity, "dcc:name", one.name + remark);
  xml_node real = child(quantity, "si:real");
  text(real, "si:value", number_text(one.value));
  text(real, "si:unit", unit);
  xml_node expanded = child(real, "si:expandedUnc");
  text(expanded, "si:uncertainty", number_text(one.uncertainty.expanded));
  text(expanded, "si:coverageFactor", number_text(one.uncertainty.coverage_factor));
  text(expanded, "si:coverageProbability", "0.95");
}

void add_results(xml_node root, const Calibration& calibration, const CertificateDetails& details) {
  xml_node result = child(child(root, "dcc:measurementResults"), "dcc:measurementResult");
  content(result, "dcc:name", "Calibration in known orientations");
  xml_node method = child(child(result, "dcc:usedMethods"), "dcc:usedMethod");
  content(method, "dcc:name",
          "linear regression, method " + std::string(method_name(calibration.fit.method)));
  content(method, "dcc:description",
          formatted("reading = bias + sensitivity times field; field {} of {} {}, readings in {}{}",
                    calibration.sensor.field.kind, number_text(calibration.sensor.field.magnitude),
                    calibration.sensor.field.unit, calibration.sensor.instrument.unit,
                    details.procedure.empty() ? "" : "; " + details.procedure));
  if (!details.environment.empty()) {
    xml_node condition = child(child(result, "dcc:influenceConditions"), "dcc:influenceCondition");
    content(condition, "dcc:name", "environment");
    content(child(condition, "dcc:data"), "dcc:text", details.environment);
  }
  xml_node one = child(child(result, "dcc:results"), "dcc:result");
  content(one, "dcc:name", "Coefficients");
  xml_node list = child(child(one, "dcc:data"), "dcc:list");
  for (const ParameterUncertainty& parameter : parameter_uncertainties(calibration)) {
    add_quantity(list, calibration, parameter);
  }
}

void require_details(const Calibration& calibration, const CertificateDetails& details) {
  std::vector<std::string> missing;
  const auto need = [&](bool stated, const std::string& what) {
    if (!stated) {
      missing.push_back(what);
    }
  };
  need(!plain(details.number).empty(), "number");
  need(details.country.size() == 2 && is_capital(details.country[0]) &&
           is_capital(details.country[1]),
       "country (two letters)");
  need(!plain(details.laboratory.name).empty(), "laboratory's name");
  need(!plain(details.customer.name).empty(), "customer's name");
  need(!details.customer.address.empty(), "customer's address");
  need(!details.authorised.empty(), "authorised");
  need(!details.calibrated.empty() || calibration.provenance.date().size() >= 10,
       "calibrated (date)");
  for (const auto& [name, date] :
       {std::pair("received", &details.received), std::pair("calibrated", &details.calibrated),
        std::pair("issued", &details.issued)}) {
    need(date->empty() || is_date(*date), formatted("{} (such as 2026-11-21)", name));
  }
  if (!missing.empty()) {
    throw RefusedError(
        formatted("a digital calibration certificate requires these entries in the laboratory's "
                  "details: {}",
                  joined(missing)),
        {settings::laboratory});
  }
  if (plain(calibration.sensor.instrument.serial).empty()) {
    throw RefusedError("a digital calibration certificate requires the instrument's serial number");
  }
  check_certifiable(calibration);
}

}  // namespace

Exported export_dcc(const Calibration& calibration, const ExportOptions& options) {
  require_details(calibration, options.laboratory);
  pugi::xml_document document;
  xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  document.append_child(pugi::node_comment)
      .set_value(formatted(" {} ", source_line(calibration)).c_str());
  xml_node root = document.append_child("dcc:digitalCalibrationCertificate");
  root.append_attribute("xmlns:dcc") = "https://ptb.de/dcc";
  root.append_attribute("xmlns:si") = "https://ptb.de/si";
  root.append_attribute("schemaVersion") = "3.2.1";
  add_administration(root, calibration, options.laboratory);
  add_results(root, calibration, options.laboratory);
  std::ostringstream out;
  document.save(out, "  ");
  return {.content = out.str(), .loss = std::nullopt};
}

}  // namespace axiscal
#endif
