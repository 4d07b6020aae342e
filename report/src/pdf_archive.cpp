// SPDX-License-Identifier: Apache-2.0
#include "pdf_archive.hpp"

#ifdef AXISCAL_QPDF
#include <lcms2.h>
#include <memory>
#include <vector>
#define POINTERHOLDER_TRANSITION 4  // qpdf's pointers are std::shared_ptr
#include <qpdf/Buffer.hh>
#include <qpdf/QPDF.hh>
#include <qpdf/QPDFEFStreamObjectHelper.hh>
#include <qpdf/QPDFEmbeddedFileDocumentHelper.hh>
#include <qpdf/QPDFFileSpecObjectHelper.hh>
#include <qpdf/QPDFWriter.hh>

#include "axiscal/core/error.hpp"
#include "axiscal/core/formatted.hpp"
#include "axiscal/core/timestamp.hpp"
#include "axiscal/core/version.hpp"
#include "html.hpp"
#elif defined(AXISCAL_PDF_ARCHIVE_MODULE)
#include "axiscal/core/late_module.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_QPDF
namespace {

// What the document is, as XMP says it; nothing else says it too, so that nothing can differ.
std::string metadata_of(const std::string& title) {
  const std::string now = timestamp_now();
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

std::string srgb_profile() {
  const cmsHPROFILE profile = cmsCreate_sRGBProfile();
  cmsUInt32Number size = 0;
  cmsSaveProfileToMem(profile, nullptr, &size);
  std::string bytes(size, '\0');
  cmsSaveProfileToMem(profile, bytes.data(), &size);
  cmsCloseProfile(profile);
  return bytes;
}

void add_output_intent(QPDF& pdf, QPDFObjectHandle& root) {
  QPDFObjectHandle profile = QPDFObjectHandle::newStream(&pdf, srgb_profile());
  profile.getDict().replaceKey("/N", QPDFObjectHandle::newInteger(3));
  QPDFObjectHandle intent = QPDFObjectHandle::newDictionary();
  intent.replaceKey("/Type", QPDFObjectHandle::newName("/OutputIntent"));
  intent.replaceKey("/S", QPDFObjectHandle::newName("/GTS_PDFA1"));
  intent.replaceKey("/OutputConditionIdentifier", QPDFObjectHandle::newString("sRGB IEC61966-2.1"));
  intent.replaceKey("/Info", QPDFObjectHandle::newString("sRGB IEC61966-2.1"));
  intent.replaceKey("/DestOutputProfile", profile);
  QPDFObjectHandle all = QPDFObjectHandle::newArray();
  all.appendItem(pdf.makeIndirectObject(intent));
  root.replaceKey("/OutputIntents", all);
}

void attach(QPDF& pdf, QPDFObjectHandle& root, const PdfAttachment& attachment) {
  auto stream = QPDFEFStreamObjectHelper::createEFStream(pdf, attachment.content);
  const std::string now = timestamp_now();  // 2026-11-26T02:00:00Z
  const std::string date =
      formatted("D:{}{}{}{}{}{}Z", now.substr(0, 4), now.substr(5, 2), now.substr(8, 2),
                now.substr(11, 2), now.substr(14, 2), now.substr(17, 2));
  stream.setSubtype(attachment.type).setCreationDate(date).setModDate(date);
  auto file = QPDFFileSpecObjectHelper::createFileSpec(pdf, attachment.name, stream);
  file.setDescription(attachment.description);
  QPDFObjectHandle handle = file.getObjectHandle();
  handle.replaceKey("/AFRelationship", QPDFObjectHandle::newName("/Data"));
  QPDFEmbeddedFileDocumentHelper(pdf).replaceEmbeddedFile(attachment.name, file);
  QPDFObjectHandle associated = QPDFObjectHandle::newArray();
  associated.appendItem(handle);
  root.replaceKey("/AF", associated);
}

}  // namespace

std::string archived_pdf(const std::string& content,
                         const std::string& title,
                         const PdfAttachment& attachment) {
  try {
    QPDF pdf;
    pdf.processMemoryFile("certificate", content.data(), content.size());
    QPDFObjectHandle root = pdf.getRoot();
    QPDFObjectHandle metadata = QPDFObjectHandle::newStream(&pdf, metadata_of(title));
    metadata.getDict().replaceKey("/Type", QPDFObjectHandle::newName("/Metadata"));
    metadata.getDict().replaceKey("/Subtype", QPDFObjectHandle::newName("/XML"));
    root.replaceKey("/Metadata", metadata);
    root.replaceKey("/Lang", QPDFObjectHandle::newString("en"));
    add_output_intent(pdf, root);
    if (!attachment.content.empty()) {
      attach(pdf, root, attachment);
    }
    pdf.getTrailer().removeKey("/Info");
    QPDFWriter writer(pdf);
    writer.setOutputMemory();
    writer.setMinimumPDFVersion("1.7");
    writer.setCompressStreams(true);
    writer.setObjectStreamMode(qpdf_o_disable);
    writer.setPreserveUnreferencedObjects(false);
    writer.write();
    const std::unique_ptr<Buffer> buffer(writer.getBuffer());
    return {reinterpret_cast<const char*>(buffer->getBuffer()), buffer->getSize()};
  } catch (const std::exception& error) {
    throw OutputError(std::string("PDF: ") + error.what());
  }
}

#elif defined(AXISCAL_PDF_ARCHIVE_MODULE)

std::string archived_pdf(const std::string& pdf,
                         const std::string& title,
                         const PdfAttachment& attachment) {
  static const auto archive = reinterpret_cast<decltype(&axiscal_archive_pdf)>(
      module_symbol(AXISCAL_PDF_ARCHIVE_MODULE, "axiscal_archive_pdf"));
  std::string archived;
  archive(pdf, title, attachment, archived);
  return archived;
}

#else

std::string archived_pdf(const std::string& pdf,
                         const std::string& /*title*/,
                         const PdfAttachment& /*attachment*/) {
  return pdf;
}

#endif

}  // namespace axiscal

#ifdef AXISCAL_QPDF
void axiscal_archive_pdf(const std::string& pdf,
                         const std::string& title,
                         const axiscal::PdfAttachment& attachment,
                         std::string& archived) {
  archived = axiscal::archived_pdf(pdf, title, attachment);
}
#endif
