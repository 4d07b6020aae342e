// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/web_page.hpp"

#ifdef AXISCAL_WEB
#include <algorithm>
#include <arpa/inet.h>
#include <array>
#include <cctype>
#include <charconv>
#include <random>
#include <utility>

#include <unistd.h>

#include "acquisition/src/page_assets.hpp"
#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/core/number_text.hpp"
#include "core/formatted.hpp"
#include "core/json_document.hpp"

namespace axiscal {
namespace {

constexpr std::size_t most_sessions = 64;
constexpr std::size_t most_events = 64;
constexpr std::size_t most_commands = 64;
constexpr std::string_view files_path = "/files/";
constexpr std::chrono::seconds control_kept{7};  // time after which a silent browser loses control

std::string random_key() {
  std::random_device device;
  constexpr std::string_view digits = "0123456789abcdef";
  std::string key;
  for (int i = 0; i < 8; ++i) {
    unsigned bits = device();
    for (int j = 0; j < 4; ++j, bits >>= 4U) {
      key += digits[bits & 15U];
    }
  }
  return key;
}

// Compares two keys in constant time.
bool same_key(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    difference |= static_cast<unsigned>(a[i] == b[i] ? 0 : 1);
  }
  return difference == 0;
}

std::string in_url(const std::string& address) {
  return address.find(':') == std::string::npos ? address : formatted("[{}]", address);
}

// True for a numeric address. An attack by DNS rebinding needs a host name.
bool is_numeric(const std::string& host) {
  return host.starts_with('[') || host.find_first_not_of("0123456789.:") == std::string::npos;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return text;
}

std::string cookie_value(const WebRequest& request, const std::string& name) {
  const std::string header = request.header("Cookie");
  for (const std::string_view part : split(header, ';')) {
    const std::string_view one = trimmed(part);
    if (one.starts_with(name + "=")) {
      return std::string(one.substr(name.size() + 1));
    }
  }
  return "";
}

// True if the page's script sent the request. A form of another site cannot set this header.
bool is_by_script(const WebRequest& request) {
  return request.has_header("X-Axiscal") &&
         request.header("Content-Type").starts_with("application/json");
}

std::string text_of(const WebRequest& request, const char* key) {
  const Json json = json_or_discarded(request.body);
  return json.is_object() && json.contains(key) && json[key].is_string()
             ? json[key].get<std::string>()
             : "";
}

// Decodes %20 and similar codes. Invalid codes stay unchanged.
std::string decoded(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* const first = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(first, first + 2, byte, 16).ptr == first + 2) {
      plain += static_cast<char>(byte);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

WebAnswer content(std::string_view text, const char* type) {
  return {.type = type, .body = std::string(text)};
}

}  // namespace

std::string bare_address(const std::string& address) {
  const bool has_brackets = address.starts_with('[') && address.ends_with(']');
  const std::string bare = has_brackets ? address.substr(1, address.size() - 2) : address;
  in6_addr parsed{};
  std::array<char, INET6_ADDRSTRLEN> text{};
  return ::inet_pton(AF_INET6, bare.c_str(), &parsed) == 1 &&
                 ::inet_ntop(AF_INET6, &parsed, text.data(), text.size()) != nullptr
             ? text.data()
             : bare;
}

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

bool is_any_address(const std::string& address) {
  return address == "0.0.0.0" || address == "::";
}

WebPage::WebPage(WebPlace place) : place_(std::move(place)), key_(random_key()) {}

std::string WebPage::url() const {
  const std::string host = is_any_address(place_.address) ? host_name() : in_url(place_.address);
  return formatted("{}://{}:{}/#{}", place_.scheme, host, place_.port, key_);
}

void WebPage::announce() const {
  std::string text;
  {
    const std::lock_guard lock(mutex_);
    text = url();
  }
  if (place_.announce) {
    place_.announce(text);
  }
}

// Refuses a request that is not supported, does not name this server, or comes from another page.
std::optional<WebAnswer> WebPage::early_refusal(const WebRequest& request) const {
  const std::optional<int> length = parse_integer(request.header("Content-Length"));
  const bool is_get = request.method == "GET" || request.method == "HEAD";
  const bool has_short_body = request.method == "POST" && length && *length >= 0 &&
                              *length <= static_cast<int>(longest_request_body);
  if (!(is_get || has_short_body) || (is_get && length.value_or(0) != 0) ||
      request.has_header("Transfer-Encoding") || request.has_header("Range")) {
    return refusal(413, "this request is not supported");
  }
  const std::string host = lower(request.header("Host"));
  const std::string port = formatted(":{}", place_.port);
  std::vector<std::string> names = {"127.0.0.1" + port, "localhost" + port};
  if (!place_.is_loopback) {
    names.push_back(lower(in_url(place_.address)) + port);
    names.push_back(lower(host_name()) + port);
    if (is_any_address(place_.address) && is_numeric(host)) {
      names.push_back(host);
    }
  }
  // Browsers omit the default port of the scheme.
  const int usual_port = place_.scheme == "https" ? 443 : 80;
  if (place_.port == usual_port) {
    for (std::size_t i = 0, count = names.size(); i < count; ++i) {
      names.push_back(names[i].substr(0, names[i].rfind(':')));
    }
  }
  const std::string origin = request.header("Origin");
  const std::string site = request.header("Sec-Fetch-Site");
  const bool good_host = std::find(names.begin(), names.end(), host) != names.end();
  const bool good_origin =
      origin.empty() || lower(origin) == formatted("{}://{}", place_.scheme, host);
  const bool good_site = site.empty() || site == "same-origin" || site == "none";
  if (!good_host || !good_origin || !good_site) {
    return refusal(403, "the request is not for this server");
  }
  return std::nullopt;
}

WebAnswer WebPage::answer(const WebRequest& request) {
  if (const std::optional<WebAnswer> refused = early_refusal(request)) {
    return *refused;
  }
  const std::string path = request.target.substr(0, request.target.find('?'));
  if (request.method == "POST") {
    return path == "/login"     ? login(request)
           : path == "/control" ? take_control(request)
           : path == "/command" ? take_command(request)
           : path == "/wish"    ? take_wish(request)
           : path == "/alive"   ? handle_heartbeat(request)
                                : refusal(404, "no such page");
  }
  return path == "/"              ? content(acquire_page(), "text/html; charset=utf-8")
         : path == "/acquire.css" ? content(acquire_style(), "text/css; charset=utf-8")
         : path == "/acquire.js"  ? content(acquire_script(), "text/javascript; charset=utf-8")
         : path.starts_with(files_path) ? file(request, decoded(path.substr(files_path.size())))
         : path == "/events" && request.method == "GET" ? stream(request)
                                                        : refusal(404, "no such page");
}

std::string WebPage::cookie_name() const {
  return formatted("axiscal-{}", place_.port);
}

// Returns the session of the requesting browser; empty if it has not logged in. The caller must
// have locked mutex_.
std::string WebPage::session_of(const WebRequest& request) const {
  const std::string value = cookie_value(request, cookie_name());
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [&](const std::string& one) { return same_key(one, value); });
  return found == sessions_.end() ? "" : *found;
}

WebAnswer WebPage::login(const WebRequest& request) {
  const std::string key = text_of(request, "key");
  WebAnswer accepted;
  bool used = false;
  {
    const std::lock_guard lock(mutex_);
    if (!is_by_script(request) || !same_key(key, key_)) {
      return refusal(403, "wrong key: open the address that the terminal shows");
    }
    const std::string session = random_key();
    sessions_.push_back(session);
    if (sessions_.size() > most_sessions) {
      sessions_.pop_front();
    }
    if (controller_.empty()) {
      owner_ = controller_ = session;
      heard_ = place_.now();
    }
    accepted.headers.emplace_back(
        "Set-Cookie", formatted("{}={}; HttpOnly; SameSite=Strict; Path=/{}", cookie_name(),
                                session, place_.scheme == "https" ? "; Secure" : ""));
    if (!place_.is_loopback) {
      key_ = random_key();
      used = true;
    }
  }
  if (used) {
    announce();
  }
  return accepted;
}

WebAnswer WebPage::take_control(const WebRequest& request) {
  const std::lock_guard lock(mutex_);
  const std::string session = session_of(request);
  if (session.empty() || !is_by_script(request)) {
    return refusal(403, "this browser has not logged in: open the address that the terminal shows");
  }
  owner_ = controller_ = session;
  heard_ = place_.now();
  ++version_;
  return {};
}

// Returns a refusal if the requesting browser does not control the session, otherwise nullopt. The
// caller must have locked mutex_.
std::optional<WebAnswer> WebPage::refused_control(const WebRequest& request) const {
  const std::string session = session_of(request);
  if (session.empty() || !is_by_script(request)) {
    return refusal(403, "this browser has not logged in: open the address that the terminal shows");
  }
  if (session != controller_) {
    return refusal(409, "another browser controls the session; take control first");
  }
  return std::nullopt;
}

WebAnswer WebPage::take_command(const WebRequest& request) {
  const std::optional<SessionCommand> command = parse_command(text_of(request, "command"));
  const std::lock_guard lock(mutex_);
  if (const std::optional<WebAnswer> refused = refused_control(request)) {
    return *refused;
  }
  if (!command) {
    return refusal(400, "this command does not exist");
  }
  if (!files_.empty()) {
    return refusal(409, "the session is over");
  }
  if (commands_.size() >= most_commands) {
    return refusal(429, "too many commands");
  }
  commands_.push_back(*command);
  owner_ = controller_;
  heard_ = place_.now();
  return {};
}

// Handles the heartbeat that each page sends every few seconds. A browser that lost control because
// it was silent regains control by its next heartbeat, unless another browser has used the control.
WebAnswer WebPage::handle_heartbeat(const WebRequest& request) {
  const std::lock_guard lock(mutex_);
  const std::string session = session_of(request);
  if (session.empty() || !is_by_script(request)) {
    return refusal(403, "this browser has not logged in: open the address that the terminal shows");
  }
  if (session == owner_ && controller_ != owner_) {
    controller_ = owner_;
    ++version_;
  }
  if (session == controller_) {
    heard_ = place_.now();
  }
  return {};
}

WebAnswer WebPage::take_wish(const WebRequest& request) {
  const std::string wish = text_of(request, "wish");
  const std::lock_guard lock(mutex_);
  if (const std::optional<WebAnswer> refused = refused_control(request)) {
    return *refused;
  }
  if (files_.empty() || (wish != "again" && wish != "leave")) {
    return refusal(400, "this choice does not exist");
  }
  wish_ = wish;
  owner_ = controller_;
  return {};
}

// Serves an output file. Its Content-Security-Policy allows only inline scripts, inline styles and
// embedded images, which a report contains.
WebAnswer WebPage::file(const WebRequest& request, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  if (session_of(request).empty()) {
    return refusal(403, "no key: open the address that the terminal shows");
  }
  const auto found = std::find_if(files_.begin(), files_.end(),
                                  [&](const SessionFile& one) { return one.name == name; });
  if (found == files_.end()) {
    return refusal(404, "no such file");
  }
  return {.type = found->type,
          .body = found->body,
          .policy =
              "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
              "img-src data: blob:"};
}

void WebPage::came(const Watcher& watcher) {
  const std::lock_guard lock(mutex_);
  watching_.push_back(watcher.session);
}

void WebPage::gone(const Watcher& watcher) {
  const std::lock_guard lock(mutex_);
  const auto at = std::find(watching_.begin(), watching_.end(), watcher.session);
  if (at != watching_.end()) {
    watching_.erase(at);
  }
}

bool WebPage::is_watched() const {
  const std::lock_guard lock(mutex_);
  return !watching_.empty();
}

// Passes control from a silent browser to the browser that has watched longest. The caller must
// have locked mutex_.
void WebPage::lend_control() {
  const auto now = place_.now();
  const auto other = std::find_if(watching_.begin(), watching_.end(),
                                  [&](const std::string& one) { return one != controller_; });
  if (other != watching_.end() && now - heard_ > control_kept) {
    controller_ = *other;
    heard_ = now;
    ++version_;
  }
}

void WebPage::offer(std::vector<SessionFile> files) {
  const std::lock_guard lock(mutex_);
  files_ = std::move(files);
  wish_.clear();
  commands_.clear();  // commands for the finished session are dropped
  ++version_;
}

std::string WebPage::wish() const {
  const std::lock_guard lock(mutex_);
  return wish_;
}

WebAnswer WebPage::stream(const WebRequest& request) const {
  const std::lock_guard lock(mutex_);
  const std::string session = session_of(request);
  if (session.empty()) {
    return refusal(403, "no key: open the address that the terminal shows");
  }
  // A browser that reconnects gets only the events after the last one that it received.
  const std::optional<int> seen = parse_integer(request.header("Last-Event-ID"));
  const std::size_t last = seen ? static_cast<std::size_t>(std::max(*seen, 0)) : last_event_;
  return {.type = "text/event-stream",
          .body = "",
          .is_stream = true,
          .session = session,
          .last_event = std::min(last, last_event_)};
}

WebPage::Watcher WebPage::watcher_for(const WebAnswer& answer) const {
  return {.session = answer.session, .event = answer.last_event};
}

std::string WebPage::news_for(Watcher& watcher) const {
  const std::lock_guard lock(mutex_);
  if (watcher.version == version_) {
    return "";
  }
  watcher.version = version_;
  std::string events;
  for (const auto& [id, event] : events_) {
    if (id > watcher.event) {
      events += (events.empty() ? "" : ",") + event;
    }
  }
  watcher.event = last_event_;
  // Sends the points that this browser has not received. If points were dropped, sends all points.
  if (watcher.dropped != dropped_ || watcher.points > points_.size()) {
    watcher.points = 0;
    watcher.dropped = dropped_;
  }
  const std::size_t from = watcher.points;
  std::string points;
  for (; watcher.points < points_.size(); ++watcher.points) {
    points += (points.empty() ? "[" : ",[") + points_[watcher.points] + "]";
  }
  Json files = Json::array();
  for (const SessionFile& one : files_) {
    files.push_back({{"name", one.name}, {"label", one.label}});
  }
  const auto text = [](const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
  };
  return formatted(
      "id: {}\ndata: {{\"title\":{},\"controls\":{},\"events\":[{}],\"files\":{},"
      "\"from\":{},\"points\":[{}],\"view\":{}}}\n\n",
      last_event_, text(Json(place_.title)), watcher.session == controller_ ? "true" : "false",
      events, text(files), from, points, view_);
}

void WebPage::show(const SessionView& view, const std::vector<SessionEvent>& events) {
  std::string text = view_json(view);
  const std::lock_guard lock(mutex_);
  view_ = std::move(text);
  ++version_;
  lend_control();
  take_points(view.free ? &*view.free : nullptr);
  for (const SessionEvent& event : events) {
    events_.emplace_back(++last_event_, event_json(event));
    if (events_.size() > most_events) {
      events_.pop_front();
    }
  }
}

// Copies the new points of a FreeSession. The caller must have locked mutex_.
void WebPage::take_points(const FreeView* free) {
  const std::size_t count = free == nullptr ? 0 : free->points.size();
  const std::size_t dropped = free == nullptr ? 0 : free->dropped;
  if (dropped != dropped_ || count < points_.size()) {
    points_.clear();
    dropped_ = dropped;
  }
  while (points_.size() < count) {
    const Eigen::Vector3d& v = free->points[points_.size()];
    points_.push_back(
        formatted("{},{},{}", number_text(v.x(), 6), number_text(v.y(), 6), number_text(v.z(), 6)));
  }
}

std::vector<SessionCommand> WebPage::commands() {
  const std::lock_guard lock(mutex_);
  return std::exchange(commands_, {});
}

}  // namespace axiscal
#endif
