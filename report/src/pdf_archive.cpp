// SPDX-License-Identifier: Apache-2.0
#include "report/src/pdf_archive.hpp"

#include <exception>

#ifdef AXISCAL_QPDF
#include "axiscal/core/error.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "core/formatted.hpp"
#include "report/src/html.hpp"
#include "report/src/qpdf_archive.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_QPDF
namespace {

// Returns the metadata of the document as XMP. pdf_archive_of() removes the PDF's Info dictionary,
// so that it cannot contradict the XMP.
std::string metadata_of(const std::string& title, const std::string& now) {
  return formatted(
      "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
      "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
      "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
      "<rdf:Description rdf:about=\"\" xmlns:pdfaid=\"http://www.aiim.org/pdfa/ns/id/\" "
      "xmlns:dc=\"http://purl.org/dc/elements/1.1/\" xmlns:xmp=\"http://ns.adobe.com/xap/1.0/\" "
      "xmlns:pdf=\"http://ns.adobe.com/pdf/1.3/\">\n"
      "<pdfaid:part>3</pdfaid:part><pdfaid:conformance>B</pdfaid:conformance>\n"
      "<dc:title><rdf:Alt><rdf:li xml:lang=\"x-default\">{}</rdf:li></rdf:Alt></dc:title>\n"
      "<xmp:CreatorTool>{}</xmp:CreatorTool><xmp:CreateDate>{}</xmp:CreateDate>"
      "<xmp:ModifyDate>{}</xmp:ModifyDate><pdf:Producer>cairo, qpdf</pdf:Producer>\n"
      "</rdf:Description></rdf:RDF></x:xmpmeta>\n<?xpacket end=\"r\"?>",
      escaped(title), software_name(), now, now);
}

}  // namespace

std::string archived_pdf(const std::string& pdf,
                         const std::string& title,
                         const PdfAttachment& attachment) {
  const std::string now = output_timestamp();  // for example 2026-11-26T02:00:00Z
  const std::string date =
      formatted("D:{}{}{}{}{}{}Z", now.substr(0, 4), now.substr(5, 2), now.substr(8, 2),
                now.substr(11, 2), now.substr(14, 2), now.substr(17, 2));
  try {
    return pdf_archive_of({.pdf = pdf,
                           .metadata = metadata_of(title, now),
                           .date = date,
                           .attachment_name = attachment.name,
                           .attachment_description = attachment.description,
                           .attachment_type = attachment.type,
                           .attachment_content = attachment.content});
  } catch (const std::exception& error) {
    throw OutputError(formatted("PDF: {}", error.what()));
  }
}

#else

std::string archived_pdf(const std::string& pdf,
                         const std::string& /*title*/,
                         const PdfAttachment& /*attachment*/) {
  return pdf;
}

#endif

}  // namespace axiscal
