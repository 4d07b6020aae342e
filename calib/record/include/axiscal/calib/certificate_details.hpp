// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// A name and an address, line by line.
struct CertificateParty {
  std::string name;
  std::vector<std::string> address;
  std::string accreditation;  ///< the laboratory's number, may be empty
  std::string logo;           ///< a PNG file, its path
  std::string mark;           ///< of the accreditation; a PNG file, its path
};

/// Data of a certificate that a record lacks (ISO/IEC 17025:2017, 7.8.2 and 7.8.4).
struct CertificateDetails {
  std::string number;  ///< unique, on every page
  CertificateParty laboratory;
  CertificateParty customer;
  std::string country;       ///< where the laboratory is, two letters (ISO 3166-1): "DE"
  std::string place;         ///< place of the calibration, if it is not the laboratory
  std::string manufacturer;  ///< who made the instrument
  std::string model;
  std::string condition;   ///< condition of the instrument when received
  std::string received;    ///< dates, ISO 8601
  std::string calibrated;  ///< default: the record's, Provenance::date()
  std::string issued;
  std::string environment;                ///< temperature, humidity, ...
  std::string procedure;                  ///< the laboratory's, besides the method
  std::vector<std::string> traceability;  ///< one statement for each reference
  std::string decision_rule;              ///< where a statement of conformity is made
  std::vector<std::string> remarks;
  std::vector<std::pair<std::string, std::string>> authorised;  ///< name, function
};

/// Reads the details: `{"format": "axiscal-laboratory", "version": 1, "number": .., "laboratory":
/// {"name": .., "address": [..], "accreditation": .., "logo": "logo.png", "accreditation_mark":
/// "mark.png"} (files named from the folder of this one), "customer": {..}, "country", "place",
/// "manufacturer", "model", "condition", "received", "calibrated", "issued", "environment",
/// "procedure", "traceability": [..], "decision_rule", "remarks": [..], "authorised": [{"name",
/// "function"}]}`. A text in angle brackets, as in the template ("<name>"), is still to be filled
/// in and counts as empty.
/// @throws DataError  for another file, an unknown key, a value of the wrong kind.
[[nodiscard]] AXISCAL_EXPORT CertificateDetails read_certificate_details(const std::string& path);

/// @throws RefusedError  if a certificate is not allowed: the calibration was refused, or it lacks
///         an uncertainty.
AXISCAL_EXPORT void check_certifiable(const Calibration& calibration);

}  // namespace axiscal
