// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/certificate_details.hpp"

#include <array>
#include <filesystem>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

// Returns the text, or an empty text if it is a placeholder of the template, such as "<name>".
std::string stated(std::string text) {
  return text.starts_with('<') && text.ends_with('>') ? std::string() : text;
}

std::vector<std::string> stated(const std::vector<std::string>& texts) {
  std::vector<std::string> all;
  for (const std::string& text : texts) {
    if (!stated(text).empty()) {
      all.push_back(text);
    }
  }
  return all;
}

// @param folder  the folder to which paths of pictures are relative.
CertificateParty party_from(const JsonValue& json, const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 5> keys = {"name", "address", "accreditation", "logo",
                                                    "accreditation_mark"};
  json.allow_keys(keys);
  const auto picture = [&](std::string_view key) {
    const std::string name = stated(json.text_or(key));
    if (!name.empty() && !name.ends_with(".png")) {
      json.at(key).fail("must be a PNG file (.png)");
    }
    return name.empty() ? name : (folder / name).string();
  };
  CertificateParty party{.name = stated(json.text_or("name")),
                         .address = {},
                         .accreditation = stated(json.text_or("accreditation")),
                         .logo = picture("logo"),
                         .mark = picture("accreditation_mark")};
  if (const auto address = json.find("address")) {
    party.address = stated(address->texts());
  }
  return party;
}

std::vector<std::string> texts_of(const JsonValue& json, std::string_view key) {
  const auto value = json.find(key);
  return value ? stated(value->texts()) : std::vector<std::string>();
}

}  // namespace

CertificateDetails read_certificate_details(const std::string& path) {
  const JsonValue json = parse_json(read_whole_file(path), path);
  json.require_format("axiscal-laboratory");
  constexpr std::array<std::string_view, 19> keys = {
      "format",        "version",      "number",      "laboratory", "customer",
      "place",         "manufacturer", "model",       "condition",  "received",
      "calibrated",    "issued",       "environment", "procedure",  "traceability",
      "decision_rule", "country",      "remarks",     "authorised"};
  json.allow_keys(keys);
  CertificateDetails details{.number = stated(json.text_or("number")),
                             .laboratory = {},
                             .customer = {},
                             .country = stated(json.text_or("country")),
                             .place = stated(json.text_or("place")),
                             .manufacturer = stated(json.text_or("manufacturer")),
                             .model = stated(json.text_or("model")),
                             .condition = stated(json.text_or("condition")),
                             .received = stated(json.text_or("received")),
                             .calibrated = stated(json.text_or("calibrated")),
                             .issued = stated(json.text_or("issued")),
                             .environment = stated(json.text_or("environment")),
                             .procedure = stated(json.text_or("procedure")),
                             .traceability = texts_of(json, "traceability"),
                             .decision_rule = stated(json.text_or("decision_rule")),
                             .remarks = texts_of(json, "remarks")};
  if (const auto laboratory = json.find("laboratory")) {
    details.laboratory = party_from(*laboratory, std::filesystem::path(path).parent_path());
  }
  if (const auto customer = json.find("customer")) {
    details.customer = party_from(*customer, std::filesystem::path(path).parent_path());
  }
  if (const auto people = json.find("authorised")) {
    for (const JsonValue& person : people->elements()) {
      constexpr std::array<std::string_view, 2> of_person = {"name", "function"};
      person.allow_keys(of_person);
      const std::string name = stated(person.at("name").text());
      if (!name.empty()) {
        details.authorised.emplace_back(name, stated(person.text_or("function")));
      }
    }
  }
  return details;
}

void check_certifiable(const Calibration& calibration) {
  if (calibration.findings.status == CalibrationStatus::refused) {
    throw RefusedError("this calibration was refused, so it cannot be certified");
  }
  if (!calibration.fit.statistics || !states_uncertainty(calibration)) {
    throw RefusedError("the record lacks uncertainties, so it cannot be certified");
  }
}

}  // namespace axiscal
