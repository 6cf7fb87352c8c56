#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

// Pages and data for one browser on this machine, over HTTP on the loopback interface.
namespace sidewall::app {

/// A request that has passed all checks.
struct WebRequest {
    std::string method;  ///< GET or POST
    std::string path;    ///< begins with a slash
    std::map<std::string, std::string>
        query;  ///< decoded; of a name that is repeated the values, NUL between them
    std::string body;
};

/// What a request gets.
struct WebReply {
    int status = 200;
    std::string type = "application/json";
    std::string body = {};
};

/// How a server listens and whom it answers.
struct WebOptions {
    std::uint16_t port = 0;  ///< 0: any that is free
    std::string token;       ///< that the first address carries, and a cookie from then on
    /// Called when the server listens, with the address that has the token.
    std::function<void(const std::string& address)> on_listening = {};
    std::function<bool()> stop = {};  ///< asked often; true ends it
};

/// Serves 127.0.0.1 until it is told to stop.
///
/// A request without the token, of another Host or from another Origin gets 403 before it is handled: so do pages of other sites, by
/// their own names or under one that they let resolve to this machine. Requests have at most 16 kB of header, 4 MB of
/// body and 20 seconds to arrive, answers 60 to be taken; at most 64 connections are open at a time. What they hold is bounded: a
/// request or answer over 100 kB with which all would hold over 24 MB, requests counted thrice, gets 503.
/// \param handle  called by several threads; its exceptions become status 500.
/// \throws IoError if the port is taken.
void serve(const WebOptions& options, const std::function<WebReply(const WebRequest&)>& handle);

/// 128 random bits as hexadecimal digits.
/// \throws IoError if the system has none.
std::string random_token();

}  // namespace sidewall::app
