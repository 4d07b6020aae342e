// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/certificate_details.hpp"

namespace axiscal {

/// @return details that ISO/IEC 17025 requires and that are missing: "the customer's name", ...
[[nodiscard]] std::vector<std::string> missing_details(const Calibration& calibration,
                                                       const CertificateDetails& details);

/// A calibration certificate, as PDF: A4, each page with the number and "page x of y", an end mark.
///
/// Missing details are left out, or shown as "not stated" if the standard requires them.
///
/// @throws RefusedError  for a refused calibration, or a record without uncertainties.
/// @throws DomainError   if this build lacks cairo.
[[nodiscard]] std::string certificate_pdf(const Calibration& calibration,
                                          const CertificateDetails& details);

}  // namespace axiscal
