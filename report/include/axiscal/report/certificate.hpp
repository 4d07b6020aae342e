// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "axiscal/calib/calibration.hpp"
#include "axiscal/calib/certificate_details.hpp"

namespace axiscal {

/// @return the missing details that ISO/IEC 17025 requires, for example "customer (name)".
[[nodiscard]] std::vector<std::string> missing_details(const Calibration& calibration,
                                                       const CertificateDetails& details);

/// Writes a calibration certificate as a PDF in A4. Each page shows the certificate's number and
/// "page x of y". The last page has an end mark.
///
/// A missing detail is shown as "not stated" if the standard requires it; otherwise it is left out.
///
/// @throws RefusedError  for a refused calibration, or a record without uncertainties.
/// @throws DomainError   if this build lacks cairo.
[[nodiscard]] std::string certificate_pdf(const Calibration& calibration,
                                          const CertificateDetails& details);

}  // namespace axiscal
