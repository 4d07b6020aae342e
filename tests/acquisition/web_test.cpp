// SPDX-License-Identifier: Apache-2.0
// The server of the session's page, without and with a network.
#include <arpa/inet.h>
#include <chrono>
#include <netinet/in.h>
#include <string>

#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "acquisition/src/web_certificate.hpp"
#include "acquisition/src/web_page.hpp"
#include "acquisition/src/web_request.hpp"
#include "acquisition/src/web_server.hpp"
#include "axiscal/acquisition/web_face.hpp"
#include "axiscal/core/random.hpp"

namespace axiscal {
namespace {

using testing::HasSubstr;

std::string lines(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& line : all) {
    text += line + "\r\n";
  }
  return text + "\r\n";
}

TEST(RequestReader, TakesBytesAsTheyCome) {
  const std::string whole = lines({"POST /login?a=b HTTP/1.1", "Host: 127.0.0.1:8712",
                                   "content-length: 4", "X-Axiscal: 1"}) +
                            "{\"a\"";
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, whole.size()}) {
    RequestReader reader;
    RequestReader::State state = RequestReader::State::needs_more;
    for (std::size_t at = 0; at < whole.size(); at += piece) {
      EXPECT_EQ(state, RequestReader::State::needs_more);
      state = reader.add(std::string_view(whole).substr(at, piece));
    }
    ASSERT_EQ(state, RequestReader::State::complete) << piece;
    EXPECT_FALSE(reader.has_more());
    const WebRequest request = reader.take();
    EXPECT_EQ(request.method, "POST");
    EXPECT_EQ(request.target, "/login?a=b");
    EXPECT_EQ(request.body, "{\"a\"");
    EXPECT_EQ(request.header("x-AXISCAL"), "1");
    EXPECT_TRUE(request.has_header("Host"));
    EXPECT_FALSE(request.has_header("Origin"));
    EXPECT_TRUE(request.keeps_alive);
  }
}

TEST(RequestReader, HasLimits) {
  const auto state_of = [](const std::string& bytes) { return RequestReader().add(bytes); };
  const std::string long_line(20000, 'y');
  EXPECT_EQ(state_of("GET / HTTP/1.1\r\nX: " + long_line), RequestReader::State::too_long);
  EXPECT_EQ(state_of("GET /" + long_line), RequestReader::State::too_long);
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 2000; ++i) {
    many += "X-" + std::to_string(i) + ": y\r\n";
  }
  EXPECT_EQ(state_of(many), RequestReader::State::too_long);
  EXPECT_EQ(state_of("POST / HTTP/1.1\r\nContent-Length: 99999999\r\n\r\n"),
            RequestReader::State::too_long);
  EXPECT_EQ(state_of("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n2000\r\n" +
                     std::string(8192, 'z') + "\r\n"),
            RequestReader::State::too_long);
  EXPECT_EQ(state_of(std::string("\0\1\2 nonsense\r\n\r\n", 17)), RequestReader::State::malformed);
  EXPECT_EQ(state_of("GET / HTTP/1.1\r\nContent-Length: -1\r\n\r\n"),
            RequestReader::State::malformed);
  // An endless header that arrives in small pieces is also rejected.
  RequestReader reader;
  RequestReader::State state = RequestReader::State::needs_more;
  std::size_t given = 0;
  for (; given < 100000 && state == RequestReader::State::needs_more; given += 100) {
    state = reader.add("X: " + std::string(96, 'a') + "\n");
  }
  EXPECT_NE(state, RequestReader::State::needs_more);
  EXPECT_LT(given, 20000U);
}

WebPlace place(std::vector<std::string>& urls) {
  return {.title = "a session",
          .scheme = "http",
          .address = "127.0.0.1",
          .port = 8712,
          .is_loopback = true,
          .announce = [&](const std::string& url) { urls.push_back(url); }};
}

WebRequest post(const std::string& target, const std::string& body) {
  return {.method = "POST",
          .target = target,
          .headers = {{"Host", "127.0.0.1:8712"},
                      {"Content-Length", std::to_string(body.size())},
                      {"Content-Type", "application/json"},
                      {"X-Axiscal", "1"}},
          .body = body,
          .keeps_alive = true};
}

TEST(WebPage, TellsOnlyWhoHasTheKey) {
  std::vector<std::string> urls;
  WebPage page(place(urls));
  page.announce();
  ASSERT_EQ(urls.size(), 1U);
  const std::string key = urls.front().substr(urls.front().find('#') + 1);
  EXPECT_EQ(key.size(), 32U);
  WebRequest events{
      .method = "GET", .target = "/events", .headers = {{"Host", "127.0.0.1:8712"}}, .body = ""};
  EXPECT_EQ(page.answer(events).status, 403);
  EXPECT_EQ(page.answer(post("/login", "{\"key\":\"0\"}")).status, 403);
  const WebAnswer entered = page.answer(post("/login", "{\"key\":\"" + key + "\"}"));
  ASSERT_EQ(entered.status, 200);
  EXPECT_THAT(entered.headers.front().second, HasSubstr("HttpOnly; SameSite=Strict"));
  const std::string cookie =
      entered.headers.front().second.substr(0, entered.headers.front().second.find(';'));
  events.headers.emplace_back("Cookie", "other=1; " + cookie);
  const WebAnswer stream = page.answer(events);
  EXPECT_TRUE(stream.is_stream);
  WebPage::Watcher watcher = page.watcher_for(stream);
  EXPECT_THAT(page.news_for(watcher), HasSubstr("\"controls\":true"));
  EXPECT_EQ(page.news_for(watcher), "") << "nothing new";
  WebRequest command = post("/command", "{\"command\":\"finish\"}");
  EXPECT_EQ(page.answer(command).status, 403);
  command.headers.emplace_back("Cookie", cookie);
  EXPECT_EQ(page.answer(command).status, 200);
  EXPECT_EQ(page.commands().size(), 1U);
  for (const auto& [name, value] :
       std::vector<std::pair<std::string, std::string>>{{"Origin", "http://evil.example"},
                                                        {"Sec-Fetch-Site", "cross-site"},
                                                        {"Transfer-Encoding", "chunked"},
                                                        {"Range", "bytes=0-1"}}) {
    WebRequest bad = command;
    bad.headers.emplace_back(name, value);
    EXPECT_GE(page.answer(bad).status, 403) << name;
  }
  command.headers.front().second = "evil.example";
  EXPECT_EQ(page.answer(command).status, 403);
  EXPECT_EQ(page.commands().size(), 0U);
}

TEST(WebPage, LendsControlWhileItsOwnerIsNotHeard) {
  std::vector<std::string> urls;
  WebPlace where = place(urls);
  std::chrono::steady_clock::time_point now{};
  where.now = [&] { return now; };
  WebPage page(std::move(where));
  page.announce();
  const std::string key = urls.front().substr(urls.front().find('#') + 1);
  const auto enter = [&] {
    const WebAnswer entered = page.answer(post("/login", "{\"key\":\"" + key + "\"}"));
    const std::string& set = entered.headers.front().second;
    return set.substr(0, set.find(';'));
  };
  const auto says = [&](const std::string& cookie, const std::string& target,
                        const std::string& body = "{}") {
    WebRequest request = post(target, body);
    request.headers.emplace_back("Cookie", cookie);
    return page.answer(request).status;
  };
  const auto undoes = [&](const std::string& cookie) {
    return says(cookie, "/command", "{\"command\":\"undo\"}");
  };
  const std::string mine = enter();
  const std::string other = enter();
  const auto watch = [&](const std::string& cookie) {
    const WebRequest events{.method = "GET",
                            .target = "/events",
                            .headers = {{"Host", "127.0.0.1:8712"}, {"Cookie", cookie}},
                            .body = ""};
    const WebPage::Watcher watcher = page.watcher_for(page.answer(events));
    page.came(watcher);
  };
  watch(mine);
  watch(other);
  const auto pass = [&](int seconds) {
    now += std::chrono::seconds(seconds);
    page.show(SessionView{}, {});
  };
  pass(5);
  EXPECT_EQ(undoes(other), 409) << "the owner may be slow";
  pass(5);
  EXPECT_EQ(says(mine, "/alive"), 200);
  EXPECT_EQ(undoes(other), 409) << "it was slow, and nobody had used control";
  pass(10);
  EXPECT_EQ(undoes(other), 200) << "it is gone";
  EXPECT_EQ(says(mine, "/alive"), 200);
  EXPECT_EQ(undoes(mine), 409) << "who used control keeps it";
  EXPECT_EQ(says(mine, "/control"), 200);
  EXPECT_EQ(undoes(mine), 200);
}

// ---- on loopback ----

class Client {
 public:
  // @param own  the IP address of the client.
  Client(int port, const std::string& own = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in from{};
    from.sin_family = AF_INET;
    ::inet_pton(AF_INET, own.c_str(), &from.sin_addr);
    static_cast<void>(::bind(socket_, reinterpret_cast<sockaddr*>(&from), sizeof from));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0;
  }
  Client(Client&& other) noexcept
      : socket_(std::exchange(other.socket_, -1)), connected_(other.connected_) {}
  Client& operator=(Client&&) = delete;
  ~Client() { ::close(socket_); }

  [[nodiscard]] bool connected() const { return connected_; }

  bool send(const std::string& text) const {
    return ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(text.size());
  }

  // @return the bytes that arrive until they contain `wanted`, the connection ends, or `patience`
  // has passed.
  [[nodiscard]] std::string receive(const std::string& wanted,
                                    std::chrono::milliseconds patience) const {
    const auto end = std::chrono::steady_clock::now() + patience;
    std::string text;
    while (text.find(wanted) == std::string::npos) {
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
          end - std::chrono::steady_clock::now());
      pollfd one{.fd = socket_, .events = POLLIN, .revents = 0};
      if (left.count() <= 0 || ::poll(&one, 1, static_cast<int>(left.count())) <= 0) {
        break;
      }
      std::array<char, 4096> block{};
      const ssize_t count = ::recv(socket_, block.data(), block.size(), 0);
      if (count <= 0) {
        ended = true;
        break;
      }
      text.append(block.data(), static_cast<std::size_t>(count));
    }
    return text;
  }

  mutable bool ended = false;

 private:
  int socket_;
  bool connected_ = false;
};

class ServerTest : public testing::Test {
 protected:
  ServerTest() : server_({.address = "127.0.0.1", .first_port = 21712, .ports_tried = 200}) {
    WebPlace where = place(urls_);
    where.port = server_.port();
    page_.emplace(std::move(where));
    server_.start(*page_);
    page_->announce();
  }

  [[nodiscard]] std::string get(const std::string& target, const std::string& cookie = "") const {
    return lines({"GET " + target + " HTTP/1.1",
                  "Host: 127.0.0.1:" + std::to_string(server_.port()), "Cookie: " + cookie});
  }

  std::string login() {
    const std::string key = urls_.back().substr(urls_.back().find('#') + 1);
    const std::string body = "{\"key\":\"" + key + "\"}";
    const Client client(server_.port());
    client.send(lines({"POST /login HTTP/1.1", "Host: 127.0.0.1:" + std::to_string(server_.port()),
                       "Content-Type: application/json", "X-Axiscal: 1",
                       "Content-Length: " + std::to_string(body.size())}) +
                body);
    const std::string answer = client.receive("{}", std::chrono::seconds(10));
    const std::size_t from = answer.find("Set-Cookie: ") + 12;
    return answer.substr(from, answer.find(';', from) - from);
  }

  std::vector<std::string> urls_;
  std::optional<WebPage> page_;
  WebServer server_;
};

TEST_F(ServerTest, AnswersAndKeepsTheConnection) {
  const Client client(server_.port());
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(client.send(get("/acquire.css")));
    const std::string answer = client.receive("}\n", std::chrono::seconds(10));
    EXPECT_THAT(answer, testing::StartsWith("HTTP/1.1 200 OK\r\n"));
    EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'none'"));
    static_cast<void>(client.receive("nothing", std::chrono::milliseconds(50)));
  }
  client.send(get("/none"));
  EXPECT_THAT(client.receive("nothing", std::chrono::seconds(10)), HasSubstr("404 Not Found"));
  EXPECT_TRUE(client.ended);
}

TEST_F(ServerTest, StreamsEventsAndEndsThem) {
  const std::string cookie = login();
  auto watcher = std::make_unique<Client>(server_.port());
  watcher->send(get("/events", cookie));
  EXPECT_THAT(watcher->receive("\"view\":null", std::chrono::seconds(10)),
              HasSubstr("text/event-stream"));
  SessionView view;
  view.headline = "Lay the cube";
  page_->show(view, {{.kind = "ask", .text = "a question"}});
  server_.publish();
  EXPECT_THAT(watcher->receive("Lay the cube", std::chrono::seconds(10)), HasSubstr("a question"));
  EXPECT_THAT(watcher->receive("still here", std::chrono::seconds(10)), HasSubstr("still here"));
  Client stranger(server_.port());
  stranger.send(get("/events"));
  EXPECT_THAT(stranger.receive("nothing", std::chrono::seconds(10)), HasSubstr("403"));
}

// A new client is answered while 400 idle connections from other addresses and its own are open.
TEST_F(ServerTest, AnswersWhoComesAnewWhateverOthersHold) {
  const std::string cookie = login();
  const Client watcher(server_.port());
  watcher.send(get("/events", cookie));
  static_cast<void>(watcher.receive("\"view\"", std::chrono::seconds(10)));
  std::vector<Client> held;
  for (int i = 0; i < 400; ++i) {
    held.emplace_back(server_.port(), "127.0.0." + std::to_string(1 + i % 9));
    held.back().send(i % 2 == 0 ? "" : "GET / HTTP/1.1\r\nHost: ");
  }
  for (int i = 0; i < 5; ++i) {
    const Client mine(server_.port());
    mine.send(get("/acquire.css"));
    EXPECT_THAT(mine.receive("200 OK", std::chrono::seconds(1)), HasSubstr("200 OK"));
  }
  SessionView view;
  view.headline = "still watched";
  page_->show(view, {});
  server_.publish();
  EXPECT_THAT(watcher.receive("still watched", std::chrono::seconds(10)),
              HasSubstr("still watched"));
}

TEST_F(ServerTest, GivesARequestFiveSeconds) {
  const Client slow(server_.port());
  slow.send("POST /login HTTP/1.1\r\nHost: x\r\nContent-Length: 1000\r\n\r\n");
  const auto begun = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < begun + std::chrono::seconds(30) && !slow.ended) {
    slow.send("x");
    static_cast<void>(slow.receive("nothing", std::chrono::milliseconds(250)));
  }
  EXPECT_TRUE(slow.ended);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(15));
}

TEST_F(ServerTest, IsNotImpressedByNoise) {
  RandomStream random(5);
  for (int i = 0; i < 300; ++i) {
    const Client client(server_.port());
    std::string noise = i % 2 == 0 ? get("/") : "";
    for (std::size_t k = 0; k < 200; ++k) {
      const auto byte = static_cast<char>(random.index(256));
      if (noise.size() > 20 && i % 2 == 0) {
        noise[random.index(noise.size())] = byte;
      } else {
        noise += byte;
      }
    }
    client.send(noise);
  }
  const Client mine(server_.port());
  mine.send(get("/acquire.css"));
  EXPECT_THAT(mine.receive("200 OK", std::chrono::seconds(10)), HasSubstr("200 OK"));
}

TEST(WebCertificate, IsMadeForASession) {
  if (!has_tls()) {
    GTEST_SKIP() << "a build without OpenSSL";
  }
  const WebCertificate one = make_certificate({"192.0.2.7", "bench", "::1"});
  const WebCertificate other = make_certificate({"bench"});
  EXPECT_THAT(one.certificate_pem, testing::StartsWith("-----BEGIN CERTIFICATE-----"));
  EXPECT_THAT(one.key_pem, HasSubstr("PRIVATE KEY"));
  EXPECT_EQ(one.fingerprint.size(), 32U * 3U - 1U);
  EXPECT_NE(one.fingerprint, other.fingerprint);
}

}  // namespace
}  // namespace axiscal
