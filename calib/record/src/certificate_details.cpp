// SPDX-License-Identifier: Apache-2.0
#include "axiscal/calib/certificate_details.hpp"

#include <array>
#include <filesystem>

#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/input_file.hpp"
#include "axiscal/core/json_document.hpp"

namespace axiscal {
namespace {

// @param folder  that pictures are named from.
CertificateParty party_from(const JsonValue& json, const std::filesystem::path& folder) {
  constexpr std::array<std::string_view, 5> keys = {"name", "address", "accreditation", "logo",
                                                    "accreditation_mark"};
  json.allow_keys(keys);
  const auto picture = [&](std::string_view key) {
    const std::string name = json.text_or(key);
    if (!name.empty() && !name.ends_with(".png")) {
      json.at(key).fail("must be a PNG file (.png)");
    }
    return name.empty() ? name : (folder / name).string();
  };
  CertificateParty party{.name = json.text_or("name"),
                         .address = {},
                         .accreditation = json.text_or("accreditation"),
                         .logo = picture("logo"),
                         .mark = picture("accreditation_mark")};
  if (const auto address = json.find("address")) {
    party.address = address->texts();
  }
  return party;
}

std::vector<std::string> texts_of(const JsonValue& json, std::string_view key) {
  const auto value = json.find(key);
  return value ? value->texts() : std::vector<std::string>();
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
  CertificateDetails details{.number = json.text_or("number"),
                             .laboratory = {},
                             .customer = {},
                             .country = json.text_or("country"),
                             .place = json.text_or("place"),
                             .manufacturer = json.text_or("manufacturer"),
                             .model = json.text_or("model"),
                             .condition = json.text_or("condition"),
                             .received = json.text_or("received"),
                             .calibrated = json.text_or("calibrated"),
                             .issued = json.text_or("issued"),
                             .environment = json.text_or("environment"),
                             .procedure = json.text_or("procedure"),
                             .traceability = texts_of(json, "traceability"),
                             .decision_rule = json.text_or("decision_rule"),
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
      details.authorised.emplace_back(person.at("name").text(), person.text_or("function"));
    }
  }
  return details;
}

void check_certifiable(const Calibration& calibration) {
  if (calibration.findings.status == CalibrationStatus::refused) {
    throw RefusedError("this calibration was refused: there is no certificate of it");
  }
  if (!calibration.fit.statistics || !states_uncertainty(calibration)) {
    throw RefusedError("the record states no uncertainty: there is no certificate of such");
  }
}

}  // namespace axiscal
