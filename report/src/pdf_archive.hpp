// SPDX-License-Identifier: Apache-2.0
// The conversion of a PDF to PDF/A, the format for archives.
#pragma once

#include <string>

namespace axiscal {

struct PdfAttachment {
  std::string name;         ///< for example "certificate.xml"
  std::string description;  ///< text that PDF viewers display
  std::string type;         ///< MIME type, for example "text/xml"
  std::string content;
};

/// @param pdf         a PDF that cairo wrote, with embedded fonts.
/// @param attachment  file to attach; if its content is empty, no file is attached.
/// @return the document as PDF/A-3b (ISO 19005-3) with XMP metadata, an sRGB output intent and the
///         attachment as an associated file. A build without qpdf returns `pdf` unchanged.
std::string archived_pdf(const std::string& pdf,
                         const std::string& title,
                         const PdfAttachment& attachment);

}  // namespace axiscal
