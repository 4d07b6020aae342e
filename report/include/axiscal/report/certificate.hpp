// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/certificate_details.hpp"

namespace axiscal {

/// @return what ISO/IEC 17025 asks for and the details do not say: "the customer's name", ...
[[nodiscard]] std::vector<std::string> missing_details(const Calibration& calibration,
                                                       const CertificateDetails& details);

/// A calibration certificate, as PDF: A4, each page with the number and "page x of y", an end mark.
///
/// What is missing is left out, or shown as "not stated" where the standard asks for it.
///
/// @throws RefusedError  for a refused calibration, or a record without uncertainty: there is no
///                       certificate of such.
/// @throws DomainError   where this build has no cairo.
[[nodiscard]] std::string certificate_pdf(const Calibration& calibration,
                                          const CertificateDetails& details);

}  // namespace axiscal
