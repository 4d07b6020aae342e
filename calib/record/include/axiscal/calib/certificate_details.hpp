// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/core/export.hpp"

namespace axiscal {

/// A party of a certificate: the laboratory or the customer.
struct CertificateParty {
  std::string name;
  std::vector<std::string> address;  ///< one entry for each line
  std::string accreditation;         ///< accreditation number of the laboratory; may be empty
  std::string logo;                  ///< path of a PNG file
  std::string mark;                  ///< accreditation mark: path of a PNG file
};

/// Data of a certificate that a record lacks (ISO/IEC 17025:2017, 7.8.2 and 7.8.4).
struct CertificateDetails {
  std::string number;  ///< unique number, printed on every page
  CertificateParty laboratory;
  CertificateParty customer;
  std::string country;       ///< country of the laboratory, two letters (ISO 3166-1): "DE"
  std::string place;         ///< place of the calibration; empty if it is the laboratory
  std::string manufacturer;  ///< manufacturer of the instrument
  std::string model;
  std::string condition;    ///< condition of the instrument when received
  std::string received;     ///< date of receipt, ISO 8601
  std::string calibrated;   ///< date of calibration, ISO 8601; if empty, Provenance::date()
  std::string issued;       ///< date of issue, ISO 8601
  std::string environment;  ///< temperature, humidity, ...
  std::string procedure;    ///< the laboratory's procedure; the certificate adds the method
  std::vector<std::string> traceability;  ///< one statement for each reference
  std::string decision_rule;              ///< rule for a statement of conformity
  std::vector<std::string> remarks;
  /// Name and function of each person who authorises the certificate.
  std::vector<std::pair<std::string, std::string>> authorised;
};

/// Reads the details from a JSON file:
/// @code
/// {"format": "axiscal-laboratory", "version": 1, "number": "..",
///  "laboratory": {"name": "..", "address": [..], "accreditation": "..",
///                 "logo": "logo.png", "accreditation_mark": "mark.png"},
///  "customer": {..}, "country": "..", "place": "..", "manufacturer": "..", "model": "..",
///  "condition": "..", "received": "..", "calibrated": "..", "issued": "..", "environment": "..",
///  "procedure": "..", "traceability": [..], "decision_rule": "..", "remarks": [..],
///  "authorised": [{"name": "..", "function": ".."}]}
/// @endcode
/// Paths are relative to the folder of the file. A text in angle brackets, such as "<name>" in the
/// template, counts as empty.
/// @throws DataError  if the format differs, a key is unknown, or a value has the wrong type.
[[nodiscard]] AXISCAL_EXPORT CertificateDetails read_certificate_details(const std::string& path);

/// Checks that a certificate is allowed for a calibration.
/// @throws RefusedError  if the calibration was refused, or if it lacks an uncertainty.
AXISCAL_EXPORT void check_certifiable(const Calibration& calibration);

}  // namespace axiscal
