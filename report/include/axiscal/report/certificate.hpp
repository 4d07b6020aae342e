// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/certificate_details.hpp"

namespace axiscal {

/// @return details that ISO/IEC 17025 requires and that are missing: "customer (name)", ...
[[nodiscard]] std::vector<std::string> missing_details(const Calibration& calibration,
                                                       const CertificateDetails& details);

/// A calibration certificate as PDF in A4. Each page has the certificate's number and "page x of
/// y"; the last page has an end mark.
///
/// Missing details are left out, or shown as "not stated" if the standard requires them.
///
/// @throws RefusedError  for a refused calibration, or a record without uncertainties.
/// @throws DomainError   if this build lacks cairo.
[[nodiscard]] std::string certificate_pdf(const Calibration& calibration,
                                          const CertificateDetails& details);

}  // namespace axiscal
