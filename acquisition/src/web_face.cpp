// SPDX-License-Identifier: Apache-2.0
#include "axiscal/acquisition/web_face.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "axiscal/acquisition/session_json.hpp"
#include "axiscal/core/error.hpp"
#include "axiscal/core/json_document.hpp"
#include "axiscal/core/number_text.hpp"
#include "page_assets.hpp"

#ifdef AXISCAL_HTTPLIB
#include <httplib.h>
#endif

namespace axiscal {

#ifdef AXISCAL_HTTPLIB
namespace {

constexpr int usual_port = 8712;
constexpr int ports_tried = 20;
constexpr std::size_t threads = 32;
constexpr std::size_t most_watchers = 16;
constexpr std::size_t longest_body = 4096;
constexpr std::size_t most_sessions = 64;
constexpr std::size_t most_events = 64;
constexpr std::size_t most_commands = 64;
constexpr std::chrono::milliseconds spacing{80};  // of what is sent to a browser
constexpr std::chrono::seconds heartbeat{2};
constexpr time_t timeout_s = 5;

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

// Takes as long for a wrong key as for the right one.
bool same_key(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    difference |= static_cast<unsigned>(a[i] == b[i] ? 0 : 1);
  }
  return difference == 0;
}

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

// An address without the brackets of IPv6 and as browsers write it: ::1 for 0:0:0:0:0:0:0:1.
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

std::string in_url(const std::string& address) {
  return address.find(':') == std::string::npos ? address : "[" + address + "]";
}

// A name may be bound to any address by its owner, an address by nobody.
bool is_numeric(const std::string& host) {
  return host.starts_with('[') || host.find_first_not_of("0123456789.:") == std::string::npos;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return text;
}

std::string cookie_value(const httplib::Request& request, const std::string& name) {
  const std::string header = request.get_header_value("Cookie");
  for (const std::string_view part : split(header, ';')) {
    const std::string_view one = trimmed(part);
    if (one.starts_with(name + "=")) {
      return std::string(one.substr(name.size() + 1));
    }
  }
  return "";
}

class PageServer : public httplib::Server {
 public:
  // The library's own queue of five is full at once when many come; then good browsers wait for
  // seconds too.
  void lengthen_queue() {
    constexpr int waiting = 256;
    ::listen(svr_sock_, waiting);
  }
};

class WebFace final : public SessionFace {
 public:
  explicit WebFace(const WebOptions& options)
      : options_(options),
        address_(options.address.empty() ? "127.0.0.1" : bare_address(options.address)) {
    // Browsers by the hundred must leave file descriptors for the session's files.
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) {
      limit.rlim_cur = limit.rlim_max;
      ::setrlimit(RLIMIT_NOFILE, &limit);
    }
    // Not the port of another session: the library's default would share it.
    server_.set_socket_options([](socket_t socket) {
      const int yes = 1;
      ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    server_.new_task_queue = [] { return new httplib::ThreadPool(threads); };
    server_.set_payload_max_length(longest_body);
    server_.set_read_timeout(timeout_s);
    server_.set_write_timeout(timeout_s);
    server_.set_keep_alive_timeout(timeout_s);
    server_.set_keep_alive_max_count(100);
    server_.set_tcp_nodelay(true);
    server_.set_default_headers(
        {{"Content-Security-Policy",
          "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src "
          "'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"},
         {"X-Content-Type-Options", "nosniff"},
         {"Referrer-Policy", "no-referrer"},
         {"Cross-Origin-Resource-Policy", "same-origin"},
         {"Cache-Control", "no-store"}});
    add_routes();
    listen();
    announce();
  }

  ~WebFace() override {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    // Browsers get the last view and a good end; but not for long.
    constexpr int tries = 50;
    for (int i = 0; i < tries && watchers_ > 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    server_.stop();
    thread_.join();
  }

  void show(const SessionView& view, const std::vector<SessionEvent>& events) override {
    const auto now = std::chrono::steady_clock::now();
    if (events.empty() && now < next_ && view.phase != SessionPhase::over) {
      return;
    }
    next_ = now + spacing;
    std::string text = view_json(view);
    {
      const std::lock_guard lock(mutex_);
      view_ = std::move(text);
      ++version_;
      for (const SessionEvent& event : events) {
        events_.emplace_back(++last_event_, event_json(event));
        if (events_.size() > most_events) {
          events_.pop_front();
        }
      }
    }
    changed_.notify_all();
  }

  std::vector<SessionCommand> commands() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(commands_, {});
  }

 private:
  using Request = httplib::Request;
  using Response = httplib::Response;

  void add_routes() {
    server_.set_pre_routing_handler([this](const Request& request, Response& response) {
      return is_ours(request, response) ? httplib::Server::HandlerResponse::Unhandled
                                        : httplib::Server::HandlerResponse::Handled;
    });
    const auto serve = [this](const char* path, std::string_view content, const char* type) {
      server_.Get(path, [content, type](const Request& /*request*/, Response& response) {
        response.set_content(content.data(), content.size(), type);
      });
    };
    serve("/", acquire_page(), "text/html; charset=utf-8");
    serve("/acquire.css", acquire_style(), "text/css; charset=utf-8");
    serve("/acquire.js", acquire_script(), "text/javascript; charset=utf-8");
    server_.Post("/login",
                 [this](const Request& request, Response& response) { login(request, response); });
    server_.Get("/events",
                [this](const Request& request, Response& response) { stream(request, response); });
    server_.Post("/control", [this](const Request& request, Response& response) {
      take_control(request, response);
    });
    server_.Post("/command", [this](const Request& request, Response& response) {
      take_command(request, response);
    });
  }

  void listen() {
    const int first = options_.port > 0 ? options_.port : usual_port;
    const int tried = options_.port > 0 ? 1 : ports_tried;
    for (port_ = first; port_ < first + tried; ++port_) {
      if (server_.bind_to_port(address_.c_str(), port_)) {
        server_.lengthen_queue();
        thread_ = std::thread([this] { server_.listen_after_bind(); });
        while (!server_.is_running()) {
          std::this_thread::yield();
        }
        return;
      }
    }
    throw OutputError("the page cannot be served at " + address_ + ", port " +
                      std::to_string(first) + ": it is taken, or not an address of this machine");
  }

  [[nodiscard]] bool is_loopback() const { return options_.address.empty(); }
  [[nodiscard]] bool is_any_address() const { return address_ == "0.0.0.0" || address_ == "::"; }

  void announce() {
    if (options_.announce) {
      const std::string host = is_any_address() ? host_name() : in_url(address_);
      options_.announce("http://" + host + ":" + std::to_string(port_) + "/#" + key_);
    }
  }

  // Whether a request is for this server by its own name, from this page or no page.
  bool is_ours(const Request& request, Response& response) const {
    const std::optional<int> length = parse_integer(request.get_header_value("Content-Length"));
    const bool is_get = request.method == "GET" || request.method == "HEAD";
    const bool has_short_body = request.method == "POST" && length && *length >= 0 &&
                                *length <= static_cast<int>(longest_body);
    if (!(is_get || has_short_body) || (is_get && length.value_or(0) != 0) ||
        request.has_header("Transfer-Encoding") || request.has_header("Range")) {
      refuse(response, 413, "no such request");
      return false;
    }
    const std::string host = lower(request.get_header_value("Host"));
    const std::string port = ":" + std::to_string(port_);
    std::vector<std::string> names = {"127.0.0.1" + port, "localhost" + port};
    if (!is_loopback()) {
      names.push_back(lower(in_url(address_)) + port);
      names.push_back(lower(host_name()) + port);
      if (is_any_address() && is_numeric(host)) {
        names.push_back(host);
      }
    }
    const std::string origin = request.get_header_value("Origin");
    const std::string site = request.get_header_value("Sec-Fetch-Site");
    const bool good_host = std::find(names.begin(), names.end(), host) != names.end();
    const bool good_origin = origin.empty() || lower(origin) == "http://" + host;
    const bool good_site = site.empty() || site == "same-origin" || site == "none";
    if (!good_host || !good_origin || !good_site) {
      refuse(response, 403, "not for this server");
      return false;
    }
    return true;
  }

  static void refuse(Response& response, int status, const char* why) {
    response.status = status;
    response.set_content(std::string("{\"error\":\"") + why + "\"}", "application/json");
  }

  static void accept(Response& response) { response.set_content("{}", "application/json"); }

  [[nodiscard]] std::string cookie_name() const { return "axiscal-" + std::to_string(port_); }

  // The session of a browser that has the key; empty for another. Under the lock.
  [[nodiscard]] std::string session_of(const Request& request) const {
    const std::string value = cookie_value(request, cookie_name());
    const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                    [&](const std::string& one) { return same_key(one, value); });
    return found == sessions_.end() ? "" : *found;
  }

  // Posts are made by the page's script only: a form of another site cannot set this header.
  static bool is_by_script(const Request& request) {
    return request.has_header("X-Axiscal") &&
           request.get_header_value("Content-Type").starts_with("application/json");
  }

  static std::string text_of(const Request& request, const char* key) {
    const Json json = Json::parse(request.body, nullptr, false);
    return json.is_object() && json.contains(key) && json[key].is_string()
               ? json[key].get<std::string>()
               : "";
  }

  void login(const Request& request, Response& response) {
    const std::string key = text_of(request, "key");
    bool used = false;
    {
      const std::lock_guard lock(mutex_);
      if (!is_by_script(request) || !same_key(key, key_)) {
        refuse(response, 403, "wrong key: open the address that the terminal shows");
        return;
      }
      const std::string session = random_key();
      sessions_.push_back(session);
      if (sessions_.size() > most_sessions) {
        sessions_.pop_front();
      }
      if (controller_.empty()) {
        controller_ = session;
      }
      response.set_header("Set-Cookie",
                          cookie_name() + "=" + session + "; HttpOnly; SameSite=Strict; Path=/");
      accept(response);
      if (!is_loopback()) {
        key_ = random_key();
        used = true;
      }
    }
    if (used) {
      announce();
    }
  }

  void take_control(const Request& request, Response& response) {
    const std::lock_guard lock(mutex_);
    const std::string session = session_of(request);
    if (session.empty() || !is_by_script(request)) {
      refuse(response, 403, "no key");
      return;
    }
    controller_ = session;
    ++version_;
    changed_.notify_all();
    accept(response);
  }

  void take_command(const Request& request, Response& response) {
    const std::optional<SessionCommand> command = parse_command(text_of(request, "command"));
    const std::lock_guard lock(mutex_);
    const std::string session = session_of(request);
    if (session.empty() || !is_by_script(request)) {
      refuse(response, 403, "no key");
    } else if (session != controller_) {
      refuse(response, 409, "another browser controls; take control first");
    } else if (!command) {
      refuse(response, 400, "no such command");
    } else if (commands_.size() >= most_commands) {
      refuse(response, 429, "too many commands");
    } else {
      commands_.push_back(*command);
      accept(response);
    }
  }

  void stream(const Request& request, Response& response) {
    std::string session;
    {
      const std::lock_guard lock(mutex_);
      session = session_of(request);
    }
    if (session.empty()) {
      refuse(response, 403, "no key: open the address that the terminal shows");
      return;
    }
    if (watchers_.fetch_add(1) >= most_watchers) {
      --watchers_;
      refuse(response, 503, "too many browsers watch");
      return;
    }
    // What happened before is no news to a browser that was there: it says what it saw last.
    const std::optional<int> seen = parse_integer(request.get_header_value("Last-Event-ID"));
    const auto state = std::make_shared<Watcher>();
    {
      const std::lock_guard lock(mutex_);
      state->event = seen ? static_cast<std::size_t>(std::max(*seen, 0)) : last_event_;
      state->event = std::min(state->event, last_event_);
    }
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, state, session](std::size_t /*offset*/, httplib::DataSink& sink) {
          const std::string text = next_message(*state, session);
          if (text.empty()) {
            sink.done();
            return true;
          }
          return sink.write(text.data(), text.size());
        },
        [this](bool /*success*/) { --watchers_; });
  }

  struct Watcher {
    std::size_t version = 0;
    std::size_t event = 0;
    std::chrono::steady_clock::time_point sent;
    bool ended = false;
  };

  // Waits for something new, at most a heartbeat; empty when the server stops.
  std::string next_message(Watcher& watcher, const std::string& session) {
    std::this_thread::sleep_until(watcher.sent + spacing);
    std::unique_lock lock(mutex_);
    if (stopping_ && watcher.version == version_) {
      return "";
    }
    changed_.wait_for(lock, heartbeat, [&] { return stopping_ || watcher.version != version_; });
    watcher.sent = std::chrono::steady_clock::now();
    if (watcher.version == version_) {
      return stopping_ ? "" : ": still here\n\n";
    }
    watcher.version = version_;
    std::string events;
    for (const auto& [id, event] : events_) {
      if (id > watcher.event) {
        events += (events.empty() ? "" : ",") + event;
      }
    }
    watcher.event = last_event_;
    return "id: " + std::to_string(last_event_) + "\ndata: {\"title\":" +
           Json(options_.title).dump(-1, ' ', false, Json::error_handler_t::replace) +
           ",\"controls\":" + (session == controller_ ? "true" : "false") + ",\"events\":[" +
           events + "],\"view\":" + view_ + "}\n\n";
  }

  WebOptions options_;
  std::string address_;
  int port_ = 0;
  PageServer server_;
  std::thread thread_;
  std::chrono::steady_clock::time_point next_;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::string key_ = random_key();
  std::deque<std::string> sessions_;
  std::string controller_;
  std::string view_ = "null";
  std::size_t version_ = 1;
  std::deque<std::pair<std::size_t, std::string>> events_;
  std::size_t last_event_ = 0;
  std::vector<SessionCommand> commands_;
  std::atomic<std::size_t> watchers_ = 0;
};

}  // namespace

std::unique_ptr<SessionFace> make_web_face(const WebOptions& options) {
  if (acquire_script().empty()) {
    throw DomainError("--web: this build has no page (it was built without node and npm)");
  }
  return std::make_unique<WebFace>(options);
}

#else

std::unique_ptr<SessionFace> make_web_face(const WebOptions& /*options*/) {
  throw DomainError("--web: this build has no server (cpp-httplib)");
}

#endif

}  // namespace axiscal
