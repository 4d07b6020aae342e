// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/web_face.hpp"

#include "axiscal/core/error.hpp"

#ifdef AXISCAL_WEB
#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include <sys/resource.h>

#include "acquisition/src/page_assets.hpp"
#include "acquisition/src/web_page.hpp"
#include "acquisition/src/web_server.hpp"
#include "axiscal/acquisition/settings.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_WEB
namespace {

constexpr int usual_port = 8712;
constexpr int ports_tried = 20;
constexpr std::chrono::milliseconds spacing{80};  // shortest time between two updates of the page

// Returns the host names by which browsers may address the server, for its certificate.
std::vector<std::string> names_of(const std::string& address) {
  std::vector<std::string> names;
  for (const std::string& name : {is_any_address(address) ? host_name() : address, host_name(),
                                  std::string("localhost"), std::string("127.0.0.1")}) {
    const bool is_name = !name.empty() && name.find_first_not_of(
                                              "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                              "0123456789.:-") == std::string::npos;
    if (is_name && std::find(names.begin(), names.end(), name) == names.end()) {
      names.push_back(name);
    }
  }
  return names;
}

// Raises the limit of open files, so that many browsers do not use up the file descriptors.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) {
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
}

class WebFace final : public SessionFace {
 public:
  explicit WebFace(const WebOptions& options)
      : address_(options.address.empty() ? "127.0.0.1" : bare_address(options.address)),
        certificate_(options.address.empty() ? WebCertificate{}
                                             : make_certificate(names_of(address_))),
        server_(WebListening{.address = address_,
                             .first_port = options.port > 0 ? options.port : usual_port,
                             .ports_tried = options.port > 0 ? 1 : ports_tried,
                             .certificate = options.address.empty() ? nullptr : &certificate_}),
        page_({.title = options.title,
               .scheme = options.address.empty() ? "http" : "https",
               .address = address_,
               .port = server_->port(),
               .is_loopback = options.address.empty(),
               .announce = [announce = options.announce,
                            fingerprint = certificate_.fingerprint](const std::string& url) {
                 if (announce) {
                   announce(url, fingerprint);
                 }
               }}) {
    raise_descriptor_limit();
    page_.announce();
    server_->start(page_);
  }

  ~WebFace() override { server_.reset(); }  // the server uses page_, so it ends first

  void show(const SessionView& view, const std::vector<SessionEvent>& events) override {
    const auto now = std::chrono::steady_clock::now();
    if (events.empty() && now < next_ && (view.phase != SessionPhase::over || concluded_)) {
      return;
    }
    concluded_ = view.phase == SessionPhase::over;
    next_ = now + spacing;
    page_.show(view, events);
    server_->publish();
  }

  std::vector<SessionCommand> commands() override { return page_.commands(); }

  // Returns after the controlling browser has answered, or all browsers are gone.
  bool conclude(const SessionView& view, const std::vector<SessionFile>& files) override {
    constexpr std::chrono::milliseconds patience{50};
    constexpr std::chrono::seconds gone_for_good{8};  // longer than the reload of a page takes
    if (!page_.is_watched() || files.empty()) {
      return false;
    }
    page_.offer(files);
    auto seen = std::chrono::steady_clock::now();
    std::string wish;
    while (wish.empty() && std::chrono::steady_clock::now() - seen < gone_for_good) {
      show(view, {});
      std::this_thread::sleep_for(patience);
      wish = page_.wish();
      seen = page_.is_watched() ? std::chrono::steady_clock::now() : seen;
    }
    page_.offer({});
    return wish == "again";
  }

 private:
  std::string address_;
  WebCertificate certificate_;
  std::optional<WebServer> server_;
  WebPage page_;
  std::chrono::steady_clock::time_point next_;
  bool concluded_ = false;  // true if the end of the session was displayed
};

}  // namespace

std::unique_ptr<SessionFace> make_web_face(const WebOptions& options) {
  if (acquire_script().empty()) {
    throw DomainError("this build lacks the page for browsers (it was built without node)",
                      {settings::web_face});
  }
  return std::make_unique<WebFace>(options);
}

#else

std::unique_ptr<SessionFace> make_web_face(const WebOptions& /*options*/) {
  throw DomainError("this build lacks the server for browsers (libboost-dev)",
                    {settings::web_face});
}

#endif

}  // namespace axiscal
