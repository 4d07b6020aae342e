// SPDX-License-Identifier: Apache-2.0
#include "acquisition/src/web_server.hpp"

#ifdef AXISCAL_WEB
#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <thread>
#include <type_traits>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/tcp_stream.hpp>

#ifdef AXISCAL_OPENSSL
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#endif

#include "acquisition/src/web_connections.hpp"
#include "axiscal/core/error.hpp"
#include "core/formatted.hpp"

namespace axiscal {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Clock = std::chrono::steady_clock;
using ErrorCode = boost::system::error_code;
using Tcp = asio::ip::tcp;

constexpr std::size_t most_watchers = 16;
constexpr std::size_t most_requests = 100;  // largest number of requests on one connection
constexpr std::chrono::seconds request_deadline{5};
constexpr std::chrono::seconds answer_deadline{20};
constexpr std::chrono::seconds event_deadline{5};
constexpr std::chrono::seconds goodbye_deadline{1};
constexpr std::chrono::milliseconds event_spacing{80};  // least time between messages to a browser
constexpr std::chrono::seconds heartbeat{2};

// Returns the network of a client: an IPv4 address, or the first 64 bits of an IPv6 address.
std::string network_of(const asio::ip::address& address) {
  if (address.is_v4()) {
    return address.to_string();
  }
  const asio::ip::address_v6 six = address.to_v6();
  if (six.is_v4_mapped()) {
    return asio::ip::make_address_v4(asio::ip::v4_mapped, six).to_string();
  }
  const auto bytes = six.to_bytes();
  return {bytes.begin(), bytes.begin() + 8};
}

template <typename Stream>
class StreamConnection final : public WebConnection,
                               public std::enable_shared_from_this<StreamConnection<Stream>> {
 public:
  StreamConnection(Stream stream, std::string network, WebConnections& shared)
      : WebConnection(std::move(network)),
        stream_(std::move(stream)),
        timer_(stream_.get_executor()),
        shared_(shared) {}

  void start() override {
    socket().expires_after(request_deadline);
    if constexpr (std::is_same_v<Stream, beast::tcp_stream>) {
      read();
    } else {
      stream_.async_handshake(Stream::server, [self = this->shared_from_this()](ErrorCode error) {
        error ? self->close() : self->read();
      });
    }
  }

  void close() override {
    if (std::exchange(closed_, true)) {
      return;
    }
    if (watches_) {
      --shared_.watchers;
      shared_.page->gone(watcher_);
    }
    timer_.cancel();
    socket().close();
    shared_.remove(this);
  }

  void wake() override {
    if (watches_ && !writing_ && !closed_) {
      try {
        pump();
      } catch (const std::exception&) {
        close();
      }
    }
  }

 private:
  beast::tcp_stream& socket() { return beast::get_lowest_layer(stream_); }

  // Does not set a deadline. The deadline set before the first read applies to the whole request.
  void read() {
    stream_.async_read_some(asio::buffer(bytes_),
                            [self = this->shared_from_this()](ErrorCode error, std::size_t count) {
                              error ? self->close() : self->take({self->bytes_.data(), count});
                            });
  }

  // An exception, for example if memory runs out, closes only this connection.
  void take(std::string_view bytes) {
    if (closed_) {
      return;
    }
    try {
      understand(bytes);
    } catch (const std::exception&) {
      close();
    }
  }

  void understand(std::string_view bytes) {
    switch (reader_.add(bytes)) {
      case RequestReader::State::needs_more:
        read();
        return;
      case RequestReader::State::malformed:
        answer(refusal(400, "malformed request"), false, true);
        return;
      case RequestReader::State::too_long:
        answer(refusal(431, "the request is too long"), false, true);
        return;
      case RequestReader::State::complete:
        break;
    }
    const bool has_more = reader_.has_more();
    const WebRequest request = reader_.take();
    const WebAnswer found = shared_.page->answer(request);
    if (request.method == "POST") {
      shared_.wake_all();  // because control may have passed to another browser
    }
    if (found.is_stream) {
      watch(found);
      return;
    }
    const bool keeps_alive = request.keeps_alive && !has_more && found.status == 200 &&
                             ++requests_ < most_requests && !shared_.stopping;
    answer(found, keeps_alive, request.method != "HEAD");
  }

  void answer(const WebAnswer& what, bool keeps_alive, bool with_body) {
    out_ = answer_head(what, keeps_alive);
    if (with_body) {
      out_ += what.body;
    }
    socket().expires_after(answer_deadline);
    asio::async_write(stream_, asio::buffer(out_),
                      [self = this->shared_from_this(), keeps_alive](ErrorCode error, std::size_t) {
                        if (error || self->closed_) {
                          self->close();
                        } else if (keeps_alive) {
                          self->reader_ = RequestReader();
                          self->socket().expires_after(request_deadline);
                          self->read();
                        } else {
                          self->say_goodbye();
                        }
                      });
  }

  // Reads the client's remaining data until a short deadline. If the socket were closed with unread
  // data, the client could lose the answer.
  void say_goodbye() {
    socket().expires_after(goodbye_deadline);
    if constexpr (std::is_same_v<Stream, beast::tcp_stream>) {
      ErrorCode ignored;
      socket().socket().shutdown(Tcp::socket::shutdown_send, ignored);
      drain(0);
    } else {
      stream_.async_shutdown([self = this->shared_from_this()](ErrorCode) { self->close(); });
    }
  }

  void drain(std::size_t drained) {
    constexpr std::size_t most = 1U << 18U;
    socket().async_read_some(asio::buffer(bytes_), [self = this->shared_from_this(), drained](
                                                       ErrorCode error, std::size_t count) {
      error || drained + count > most ? self->close() : self->drain(drained + count);
    });
  }

  // ---- event stream to a watching browser ----

  void watch(const WebAnswer& stream) {
    if (shared_.watchers >= most_watchers) {
      answer(refusal(503, "too many browsers are watching"), false, true);
      return;
    }
    ++shared_.watchers;
    watches_ = true;
    watcher_ = shared_.page->watcher_for(stream);
    shared_.page->came(watcher_);
    send(answer_head(stream, false));
  }

  void send(std::string text) {
    out_ = std::move(text);
    writing_ = true;
    timer_.cancel();
    socket().expires_after(event_deadline);
    asio::async_write(stream_, asio::buffer(out_),
                      [self = this->shared_from_this()](ErrorCode error, std::size_t) {
                        self->writing_ = false;
                        self->sent_ = Clock::now();
                        if (error || self->ended_) {
                          self->close();
                        } else {
                          self->socket().expires_never();
                          self->wake();
                        }
                      });
  }

  // Sends new data, at most once per event_spacing. Without new data, sends a heartbeat.
  void pump() {
    const Clock::time_point now = Clock::now();
    if (now < sent_ + event_spacing && !shared_.stopping) {
      wait_until(sent_ + event_spacing);
      return;
    }
    const std::string news = shared_.page->news_for(watcher_);
    if (!news.empty()) {
      send(answer_chunk(news));
    } else if (shared_.stopping) {
      ended_ = true;
      send(answer_chunk(""));
    } else if (now >= sent_ + heartbeat) {
      send(answer_chunk(": still here\n\n"));
    } else {
      wait_until(sent_ + heartbeat);
    }
  }

  void wait_until(Clock::time_point time) {
    timer_.expires_at(time);
    timer_.async_wait([self = this->shared_from_this()](ErrorCode error) {
      if (!error) {
        self->wake();
      }
    });
  }

  Stream stream_;
  asio::steady_timer timer_;
  WebConnections& shared_;
  RequestReader reader_;
  std::array<char, 4096> bytes_{};
  std::string out_;
  std::size_t requests_ = 0;
  bool closed_ = false;
  bool writing_ = false;
  bool ended_ = false;
  WebPage::Watcher watcher_;
  Clock::time_point sent_;
};

}  // namespace

class WebServer::Listener {
 public:
  explicit Listener(const WebListening& listening) : acceptor_(context_), pause_(context_) {
    if (listening.certificate != nullptr) {
      use_tls(*listening.certificate);
    }
    bind(listening);
  }

  ~Listener() {
    asio::post(context_, [this] {
      shared_.stopping = true;
      ErrorCode ignored;
      acceptor_.close(ignored);
      shared_.wake_all();
    });
    // Waits, half a second at most, until the browsers have received the last view.
    constexpr int tries = 50;
    for (int i = 0; i < tries && shared_.watchers > 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    context_.stop();
    if (thread_.joinable()) {
      thread_.join();
    }
    shared_.clear();  // the connections must end before context_
  }

  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  [[nodiscard]] int port() const { return port_; }

  void start(WebPage& page) {
    shared_.page = &page;
    accept();
    thread_ = std::thread([this] {
      for (bool done = false; !done;) {
        try {
          context_.run();
          done = true;
        } catch (const std::exception&) {
          // An error of one client, such as a lack of memory, does not affect other clients.
        }
      }
    });
  }

  void publish() {
    asio::post(context_, [this] { shared_.wake_all(); });
  }

 private:
  void bind(const WebListening& listening) {
    ErrorCode error;
    Tcp::resolver resolver(context_);
    const auto found = resolver.resolve(listening.address, "0", Tcp::resolver::passive, error);
    for (port_ = listening.first_port;
         !error && port_ < listening.first_port + listening.ports_tried; ++port_) {
      const Tcp::endpoint endpoint(found.begin()->endpoint().address(),
                                   static_cast<unsigned short>(port_));
      ErrorCode failed;
      acceptor_.open(endpoint.protocol(), failed);
      if (endpoint.address().is_v6()) {
        acceptor_.set_option(asio::ip::v6_only(false), failed);
      }
      acceptor_.set_option(Tcp::acceptor::reuse_address(true), failed);
      acceptor_.bind(endpoint, failed);
      if (!failed) {
        // The queue of waiting clients is as long as the system allows, but at least 256. If it is
        // full, the system drops the first packet of a client, which sends it again a second later.
        constexpr int at_least = 256;
        acceptor_.listen(std::max<int>(at_least, Tcp::acceptor::max_listen_connections), failed);
      }
      if (!failed) {
        return;
      }
      acceptor_.close(failed);
    }
    throw OutputError(
        formatted("cannot listen on {}, port {}: the port is in use, or the address does not "
                  "belong to this machine",
                  listening.address, listening.first_port));
  }

  void accept() {
    acceptor_.async_accept([this](ErrorCode error, Tcp::socket socket) {
      if (shared_.stopping) {
        return;
      }
      if (error) {  // for example no free file descriptor
        constexpr std::chrono::milliseconds moment{100};
        pause_.expires_after(moment);
        pause_.async_wait([this](ErrorCode) { accept(); });
        return;
      }
      accept();
      try {
        take(std::move(socket));
      } catch (const std::exception&) {
        // If memory runs out, only this connection is dropped.
      }
    });
  }

  void take(Tcp::socket socket) {
    ErrorCode error;
    const Tcp::endpoint client = socket.remote_endpoint(error);
    const std::string network = error ? "" : network_of(client.address());
    if (error || !shared_.make_room(network)) {
      return;
    }
    socket.set_option(Tcp::no_delay(true), error);
    std::shared_ptr<WebConnection> connection;
#ifdef AXISCAL_OPENSSL
    if (tls_) {
      using Tls = beast::ssl_stream<beast::tcp_stream>;
      connection = std::make_shared<StreamConnection<Tls>>(
          Tls(beast::tcp_stream(std::move(socket)), *tls_), network, shared_);
    }
#endif
    if (!connection) {
      connection = std::make_shared<StreamConnection<beast::tcp_stream>>(
          beast::tcp_stream(std::move(socket)), network, shared_);
    }
    shared_.add(connection);
    connection->start();
  }

#ifdef AXISCAL_OPENSSL
  void use_tls(const WebCertificate& certificate) {
    tls_.emplace(asio::ssl::context::tls_server);
    tls_->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv2 |
                      asio::ssl::context::no_sslv3 | asio::ssl::context::no_tlsv1 |
                      asio::ssl::context::no_tlsv1_1 | asio::ssl::context::no_compression);
    SSL_CTX_set_options(tls_->native_handle(), SSL_OP_NO_RENEGOTIATION);
    tls_->use_certificate_chain(asio::buffer(certificate.certificate_pem));
    tls_->use_private_key(asio::buffer(certificate.key_pem), asio::ssl::context::pem);
  }

  std::optional<asio::ssl::context> tls_;
#else
  void use_tls(const WebCertificate& /*certificate*/) {}
#endif

  WebConnections shared_;
  asio::io_context context_{1};
  Tcp::acceptor acceptor_;
  asio::steady_timer pause_;
  int port_ = 0;
  std::thread thread_;
};

WebServer::WebServer(const WebListening& listening)
    : listener_(std::make_unique<Listener>(listening)) {}

WebServer::~WebServer() = default;

int WebServer::port() const {
  return listener_->port();
}

void WebServer::start(WebPage& page) {
  listener_->start(page);
}

void WebServer::publish() {
  listener_->publish();
}

}  // namespace axiscal
#endif
