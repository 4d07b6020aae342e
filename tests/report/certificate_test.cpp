// SPDX-License-Identifier: Apache-2.0
#include "axiscal/report/certificate.hpp"

#include <cstdlib>

#include <gmock/gmock.h>

#include "axiscal/calib/calibrate.hpp"
#include "axiscal/calib/uncertainty.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/exchange/export.hpp"
#include "program.hpp"
#include "report/src/pdf_archive.hpp"
#include "scenario.hpp"

namespace axiscal::test {
namespace {

using testing::HasSubstr;
using testing::Not;

Calibration certified() {
  SensorModel truth = accelerometer_truth();
  truth.instrument.serial = "A-17";
  Experiment experiment = experiment_for(truth);
  experiment.field.magnitude_u = 1e-6;
  return calibrate(experiment, observe(truth, {.replicates = 2, .noise_sd = 1e-4}));
}

CertificateDetails details() {
  return {.number = "2026-1107",
          .laboratory = {.name = "Windkanal Müller", .address = {"Hauptstr. 1", "Bonn"}},
          .customer = {.name = "Aero Ltd", .address = {"Bedford"}},
          .condition = "good",
          .issued = "2026-11-21",
          .environment = "23.0 °C",
          .traceability = {"Voltage: certificate 4711."},
          .authorised = {{"A. Müller", "head"}}};
}

#ifdef AXISCAL_CAIRO
// @return the text of a PDF; the pages are separated by form feeds.
std::string text_of(const std::string& pdf) {
  const ScratchFolder folder;
  folder.write("c.pdf", pdf);
  const std::string command =
      "pdftotext -layout '" + folder.path("c.pdf") + "' '" + folder.path("c.txt") + "'";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return read_file(folder.path("c.txt"));
}

class Certificate : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("pdftotext -v > /dev/null 2>&1") != 0) {
      GTEST_SKIP() << "no pdftotext";
    }
  }
};

TEST_F(Certificate, SaysWhatTheStandardAsks) {
  Calibration calibration = certified();
  calibration.findings.verdict =
      Verdict{.passed = true,
              .rule = "guarded",
              .limits = {{.parameter = "x.bias", .value = 0.01, .high = 0.1}}};
  const std::string text = text_of(certificate_pdf(calibration, details()));
  for (const char* const needed :
       {"Calibration certificate", "2026-1107", "Windkanal Müller, Hauptstr. 1, Bonn", "Aero Ltd",
        "A-17", "23.0 °C", "Voltage: certificate 4711.", "sensitivity of z along y", "factor k",
        "accepted", "JCGM 100:2008", "Guarded acceptance", "The item meets the limits above.",
        "relate only to the item", "A. Müller, head", "end of the certificate"}) {
    EXPECT_THAT(text, HasSubstr(needed));
  }
  // Each page has the certificate's number, and its page number of the total.
  const auto pages = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\f'));
  ASSERT_GE(pages, 2U);
  std::size_t at = 0;
  for (std::size_t page = 1; page <= pages; ++page) {
    const std::size_t end = text.find('\f', at);
    const std::string one = text.substr(at, end - at);
    EXPECT_THAT(one, HasSubstr("Calibration certificate 2026-1107, Windkanal Müller"));
    EXPECT_THAT(one, HasSubstr("page " + std::to_string(page) + " of " + std::to_string(pages)));
    at = end + 1;
  }
  EXPECT_THAT(text.substr(0, text.find('\f')), Not(HasSubstr("end of the certificate")));
}

// U is rounded to two digits, and the value to the same place.
TEST_F(Certificate, RoundsTheValueToItsUncertainty) {
  Calibration calibration = certified();
  calibration.sensor.response.bias(0) = 0.0120001;
  calibration.fit.uncertainty.reset();
  calibration.fit.statistics->covariance.setIdentity();
  calibration.fit.statistics->covariance *= 1e-8;  // u = 1e-4
  calibration.fit.statistics->components.clear();
  calibration.fit.statistics->interval_95.resize(0);
  const double k = calibration.fit.statistics->coverage_factor(0);
  ASSERT_GT(k, 2.0);
  ASSERT_LT(k, 3.0);
  const std::string text = text_of(certificate_pdf(calibration, details()));
  const std::size_t row = text.find("bias of x");
  EXPECT_THAT(text.substr(row, 60), HasSubstr(" 0.01200 "));
}

// The certificate is a draft until all details are stated.
TEST_F(Certificate, IsADraftUntilAllIsStated) {
  EXPECT_THAT(text_of(certificate_pdf(certified(), {})), HasSubstr("DRAFT"));
  EXPECT_THAT(text_of(certificate_pdf(certified(), details())), Not(HasSubstr("DRAFT")));
}

TEST_F(Certificate, HasTheLaboratorysPictures) {
  const ScratchFolder folder;
  const std::string plain = certificate_pdf(certified(), details());
  CertificateDetails with = details();
  // A picture: PNG, 1 x 1 pixel, black.
  with.laboratory.logo = folder.write(
      "logo.png",
      std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\1\0\0\0\1\b\0\0\0\0:~\x9bU\0\0\0\nIDATx\x9c"
                  "c`\0\0\0\2\0\1H\xaf\xa4q\0\0\0\0IEND\xae"
                  "B`\x82",
                  67));
  EXPECT_GT(certificate_pdf(certified(), with).size(), plain.size());
  with.laboratory.logo = folder.write("other.png", "no picture");
  EXPECT_THAT([&] { static_cast<void>(certificate_pdf(certified(), with)); },
              testing::ThrowsMessage<DataError>(HasSubstr("other.png: is not a picture")));
}

#ifdef AXISCAL_QPDF
// The file has the parts of PDF/A-3: metadata, output intent, embedded fonts, and the DCC as an
// associated file.
TEST_F(Certificate, CarriesItsDccAsAnArchiveDoes) {
  CertificateDetails whole = details();
  whole.country = "DE";
  const Calibration calibration = certified();  // one, since records have their time
  const std::string pdf = certificate_pdf(calibration, whole);
  for (const char* const needed :
       {"<pdfaid:part>3</pdfaid:part>", "/GTS_PDFA1", "/AFRelationship /Data", "/EmbeddedFiles",
        "certificate-dcc.xml"}) {
    EXPECT_NE(pdf.find(needed), std::string::npos) << needed;
  }
  EXPECT_EQ(pdf.find("/Info"), pdf.find("/Info (sRGB")) << "one place says what the document is";
  const ScratchFolder folder;
  folder.write("c.pdf", pdf);
  const std::string in = "cd '" + folder.path("") + "' && ";
  ASSERT_EQ(std::system((in + "pdfdetach -saveall c.pdf").c_str()), 0);
  EXPECT_EQ(read_file(folder.path("certificate-dcc.xml")),
            export_calibration(calibration, "dcc", {.laboratory = whole}).content);
  ASSERT_EQ(std::system((in + "pdffonts c.pdf > fonts.txt").c_str()), 0);
  const std::string fonts = read_file(folder.path("fonts.txt"));
  EXPECT_THAT(fonts, HasSubstr("yes"));
  EXPECT_THAT(fonts, Not(HasSubstr(" no  no ")));
}

// An error of qpdf becomes an Axiscal error.
TEST_F(Certificate, SaysWhyThereIsNoArchive) {
  EXPECT_THAT([] { static_cast<void>(archived_pdf("no document", "title", {})); },
              testing::ThrowsMessage<OutputError>(HasSubstr("PDF: ")));
}
#endif

TEST_F(Certificate, AnyTextIsPrinted) {
  Calibration calibration = certified();
  calibration.sensor.instrument.serial = "bad \xff utf-8 \x01 " + std::string(300, 'w');
  CertificateDetails bare;
  bare.remarks = {std::string(5000, 'a')};
  const std::string text = text_of(certificate_pdf(calibration, bare));
  EXPECT_THAT(text, HasSubstr("bad ? utf-8"));
  EXPECT_THAT(text, HasSubstr("not stated"));
  EXPECT_EQ(std::count(text.begin(), text.end(), 'a') > 5000, true);
}

// The first page states which inputs are not included in the uncertainties.
TEST_F(Certificate, SaysWhatItDoesNotCount) {
  const std::string with_magnitude = text_of(certificate_pdf(certified(), details()));
  EXPECT_THAT(with_magnitude,
              HasSubstr("do not include the uncertainty of: the cube's face normals"));
  EXPECT_THAT(with_magnitude, Not(HasSubstr("no claim in SI units")));
  const Calibration local =
      calibrate(experiment_for(accelerometer_truth()),
                observe(accelerometer_truth(), {.replicates = 2, .noise_sd = 1e-4}));
  EXPECT_THAT(text_of(certificate_pdf(local, details())), HasSubstr("no claim in SI units"));
  EXPECT_THAT(not_counted(local), testing::Contains("local gravity"));
  EXPECT_THAT(not_counted(local), testing::Contains("the voltage reference"));
}

TEST_F(Certificate, ThereIsNoneOfWhatWasRefused) {
  Calibration refused = certified();
  refused.findings.status = CalibrationStatus::refused;
  EXPECT_THROW(static_cast<void>(certificate_pdf(refused, details())), RefusedError);
  Calibration bare;
  bare.sensor = accelerometer_truth();
  EXPECT_THROW(static_cast<void>(certificate_pdf(bare, details())), RefusedError);
  // Four readings for four coefficients leave no degrees of freedom, so there is no uncertainty.
  Calibration exact = certified();
  exact.fit.statistics->degrees_of_freedom.setZero();
  exact.fit.statistics->interval_95.resize(0);
  EXPECT_THROW(static_cast<void>(certificate_pdf(exact, details())), RefusedError);
}
#endif

TEST(CertificateDetailsFile, IsReadAndChecked) {
  const ScratchFolder folder;
  const std::string path =
      folder.write("lab.json", R"({"format": "axiscal-laboratory", "version": 1,
"number": "7", "laboratory": {"name": "L", "address": ["a", "b"]},
"authorised": [{"name": "N", "function": "head"}]})");
  const CertificateDetails read = read_certificate_details(path);
  EXPECT_EQ(read.number, "7");
  EXPECT_EQ(read.laboratory.address.size(), 2U);
  EXPECT_EQ(read.authorised.front().second, "head");
  const std::vector<std::string> missing = missing_details(certified(), read);
  EXPECT_THAT(missing, testing::Contains("customer (name)"));
  EXPECT_THAT(missing, Not(testing::Contains("number")));
  EXPECT_TRUE(missing_details(certified(), details()).empty());
  // Without the uncertainty of the magnitude the certificate makes no claim in SI units.
  const Calibration local =
      calibrate(experiment_for(accelerometer_truth()),
                observe(accelerometer_truth(), {.replicates = 2, .noise_sd = 1e-4}));
  EXPECT_THAT(missing_details(local, details()), testing::Contains(HasSubstr("SI units")));
  const std::string wrong = folder.write(
      "wrong.json", R"({"format": "axiscal-laboratory", "version": 1, "custommer": {}})");
  try {
    static_cast<void>(read_certificate_details(wrong));
    FAIL() << "was taken";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("customer"));
  }
}

}  // namespace
}  // namespace axiscal::test
