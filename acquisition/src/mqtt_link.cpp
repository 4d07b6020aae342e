// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <deque>
#include <optional>
#include <thread>

#include "acquisition/src/device_sources.hpp"
#include "acquisition/src/sample_clock.hpp"
#include "axiscal/core/error.hpp"

#ifdef AXISCAL_MQTT
#include <cstdlib>
#include <mosquitto.h>

#include <sys/stat.h>

#include "axiscal/core/input_file.hpp"
#include "core/formatted.hpp"
#endif

namespace axiscal {

#ifdef AXISCAL_MQTT
namespace {

constexpr int keep_alive_s = 10;
constexpr double connect_again_after_s = 1.0;
constexpr std::size_t most_waiting_bytes = 1U << 22U;

struct ClientDeleter {
  void operator()(mosquitto* client) const { mosquitto_destroy(client); }
};

// Returns the password for the broker. It is not part of the address, because journals and messages
// contain addresses.
std::string password_of(const SourceAddress& address) {
  const std::optional<std::string> path = address.find("password-file");
  const char* const stated = std::getenv("AXISCAL_MQTT_PASSWORD");  // NOLINT(concurrency-mt-unsafe)
  if (!path) {
    return stated != nullptr ? stated : "";
  }
  struct stat status {};
  if (::stat(path->c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    address.fail(
        formatted("{}: other users can read this password file; run chmod 600 on the file", *path));
  }
  std::string text = read_whole_file(*path);
  text.resize(text.find_last_not_of("\r\n") + 1);
  return text;
}

class MqttLink final : public ByteLink {
 public:
  explicit MqttLink(const SourceAddress& address)
      : address_(address), qos_(static_cast<int>(address.number_or("qos", 1.0, 0.0, 2.0))) {
    const std::size_t slash = address.place.find('/');
    if (slash == std::string::npos || slash + 1 == address.place.size()) {
      address.fail(formatted("expected {}://HOST:PORT/TOPIC", address.scheme));
    }
    topic_ = address.place.substr(slash + 1);
    SourceAddress server = address;
    server.place.resize(slash);
    const bool is_encrypted = address.scheme == "mqtts";
    server_ = host_and_port(server, is_encrypted ? "8883" : "1883");
    static const bool ready = mosquitto_lib_init() == MOSQ_ERR_SUCCESS;
    client_.reset(ready ? mosquitto_new(nullptr, true, this) : nullptr);
    if (!client_) {
      address.fail("libmosquitto cannot be started");
    }
    if (const std::optional<std::string> user = address.find("user")) {
      mosquitto_username_pw_set(client_.get(), user->c_str(), password_of(address).c_str());
    }
    if (is_encrypted) {
      const std::optional<std::string> authority = address.find("ca");
      const int status =
          mosquitto_tls_set(client_.get(), authority ? authority->c_str() : nullptr,
                            authority ? nullptr : "/etc/ssl/certs", nullptr, nullptr, nullptr);
      if (status != MOSQ_ERR_SUCCESS) {
        address.fail(formatted("the certificates in {} cannot be loaded ({})",
                               authority.value_or("/etc/ssl/certs"), mosquitto_strerror(status)));
      }
    }
    mosquitto_connect_callback_set(client_.get(), [](mosquitto* client, void* self, int code) {
      static_cast<MqttLink*>(self)->connected(client, code);
    });
    mosquitto_message_callback_set(
        client_.get(), [](mosquitto* /*client*/, void* self, const mosquitto_message* message) {
          static_cast<MqttLink*>(self)->take(*message);
        });
  }

  [[nodiscard]] bool has_messages() const override { return true; }

  LinkReport read(std::string& bytes, std::chrono::milliseconds patience) override {
    const double now = session_seconds();
    if (!connected_ && !trying_) {
      if (now < next_try_s_) {
        std::this_thread::sleep_for(patience);
        return unconnected();
      }
      next_try_s_ = now + connect_again_after_s;
      const int error = mosquitto_connect(client_.get(), server_.host.c_str(),
                                          std::stoi(server_.port), keep_alive_s);
      if (error != MOSQ_ERR_SUCCESS) {
        message_ = text_of(error);
        return unconnected();
      }
      trying_ = true;
    }
    const int wait_ms = waiting_.empty() ? static_cast<int>(patience.count()) : 0;
    const int error = mosquitto_loop(client_.get(), wait_ms, 1);
    if (!waiting_.empty()) {
      bytes += waiting_.front();
      waiting_bytes_ -= waiting_.front().size();
      waiting_.pop_front();
    }
    if (error != MOSQ_ERR_SUCCESS) {
      message_ = text_of(error);
      was_connected_ = was_connected_ || connected_;
      connected_ = false;
      trying_ = false;
      next_try_s_ = session_seconds() + connect_again_after_s;
    }
    if (!connected_) {
      return unconnected();
    }
    return {.state = LinkState::open, .message = "", .reopened = std::exchange(reopened_, false)};
  }

 private:
  void connected(mosquitto* client, int code) {
    if (code != 0) {
      message_ = formatted("{}: {}", address_.text, mosquitto_connack_string(code));
      return;
    }
    connected_ = true;
    reopened_ = was_connected_;
    was_connected_ = true;
    message_.clear();
    mosquitto_subscribe(client, nullptr, topic_.c_str(), qos_);
  }

  void take(const mosquitto_message& message) {
    const auto size = static_cast<std::size_t>(std::max(message.payloadlen, 0));
    if (waiting_bytes_ + size < most_waiting_bytes) {
      waiting_.emplace_back(static_cast<const char*>(message.payload), size);
      waiting_bytes_ += size;
    }
  }

  [[nodiscard]] LinkReport unconnected() const {
    return {.state = was_connected_ ? LinkState::lost : LinkState::waiting, .message = message_};
  }

  [[nodiscard]] std::string text_of(int error) const {
    return formatted("{}: {}", address_.text, mosquitto_strerror(error));
  }

  SourceAddress address_;
  int qos_;
  std::string topic_;
  HostAndPort server_;
  std::unique_ptr<mosquitto, ClientDeleter> client_;
  bool connected_ = false;
  bool was_connected_ = false;
  bool reopened_ = false;
  bool trying_ = false;
  double next_try_s_ = 0.0;
  std::string message_;
  std::deque<std::string> waiting_;  // received messages that read() has not returned yet
  std::size_t waiting_bytes_ = 0;
};

}  // namespace

bool has_mqtt() noexcept {
  return true;
}

std::unique_ptr<ByteLink> open_mqtt(const SourceAddress& address) {
  return std::make_unique<MqttLink>(address);
}

#else

bool has_mqtt() noexcept {
  return false;
}

std::unique_ptr<ByteLink> open_mqtt(const SourceAddress& address) {
  address.fail("this build lacks libmosquitto");
}

#endif

}  // namespace axiscal
