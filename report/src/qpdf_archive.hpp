// SPDX-License-Identifier: Apache-2.0
// The part of a PDF archive that qpdf makes. This is C++17, as its source is.
#pragma once

#include <string>

namespace axiscal {

/// The parts of an archive's PDF.
struct PdfArchiveParts {
  std::string pdf;       ///< as cairo writes it, with its fonts
  std::string metadata;  ///< XMP
  std::string date;      ///< of the attachment, in PDF's form: "D:20261126020000Z"
  std::string attachment_name;
  std::string attachment_description;
  std::string attachment_type;
  std::string attachment_content;  ///< empty: without an attachment
};

/// @return the document as PDF/A-3b.
/// @throws std::exception  of qpdf, if the PDF is damaged.
[[nodiscard]] std::string pdf_archive_of(const PdfArchiveParts& parts);

}  // namespace axiscal
