// SPDX-License-Identifier: Apache-2.0
// The functions that use qpdf. This header must be valid C++17, see qpdf_archive.cpp.
#pragma once

#include <string>

namespace axiscal {

/// The parts of an archival PDF (PDF/A).
struct PdfArchiveParts {
  std::string pdf;       ///< a PDF that cairo wrote, with embedded fonts
  std::string metadata;  ///< XMP
  std::string date;      ///< date of the attachment in the format of PDF: "D:20261126020000Z"
  std::string attachment_name;
  std::string attachment_description;
  std::string attachment_type;
  std::string attachment_content;  ///< content of the attachment; empty: no attachment
};

/// @return the document as PDF/A-3b.
/// @throws std::exception  from qpdf, if the PDF is damaged.
[[nodiscard]] std::string pdf_archive_of(const PdfArchiveParts& parts);

}  // namespace axiscal
