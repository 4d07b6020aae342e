// SPDX-License-Identifier: Apache-2.0
// What qpdf does for an archive's PDF. This is C++17, as its source is.
#pragma once

#include <string>

namespace axiscal {

struct PdfAttachment {
  std::string name;         ///< "certificate.xml"
  std::string description;  ///< for people
  std::string type;         ///< "text/xml"
  std::string content;
};

}  // namespace axiscal

/// Exported by the module with qpdf in it, where there is one. The loader knows it by its name
/// alone: whoever changes what it takes counts it up.
/// @param pdf         as cairo writes it: its fonts are within.
/// @param metadata    as XMP.
/// @param date        of the attachment, as PDF has it: "D:20261126020000Z".
/// @param attachment  nothing where its content is empty.
/// @throws std::exception  by qpdf.
extern "C" __attribute__((visibility("default"))) void axiscal_archive_pdf_2(
    const std::string& pdf,
    const std::string& metadata,
    const std::string& date,
    const axiscal::PdfAttachment& attachment,
    std::string& archived);
