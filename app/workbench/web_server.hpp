#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

// An HTTP server on the loopback interface, for a browser on this machine.
namespace sidewall::app {

/// A request that has passed all checks.
struct WebRequest {
    std::string method;                        ///< GET or POST
    std::string path;                          ///< begins with a slash
    std::map<std::string, std::string> query;  ///< decoded; NUL separates the values of a repeated name
    std::string body;
};

/// The answer to a request.
struct WebReply {
    int status = 200;
    std::string type = "application/json";
    std::string body = {};
};

/// How the server listens, and whom it answers.
struct WebOptions {
    std::uint16_t port = 0;  ///< 0: any free one
    std::string token;       ///< secret in the printed address; later requests carry it in a cookie
    /// Called when the server listens, with the address that holds the token.
    std::function<void(const std::string& address)> on_listening = {};
    std::function<bool()> stop = {};  ///< asked ten times a second; true ends the server
};

/// Serves 127.0.0.1 until options.stop returns true.
///
/// A request without the token, for another Host or from another Origin gets 403 and is not handled. This
/// refuses pages of other sites, even under names that resolve to this machine. Requests have at most 16 kB
/// of header, 4 MB of body and 20 s to arrive, answers 60 s to be taken. At most 64 connections are open. A
/// request or answer over 100 kB gets 503 if all would hold over 24 MB in memory, requests counted thrice.
/// \param handle  called by several threads; its exceptions become status 500.
/// \throws IoError if the port is taken.
void serve(const WebOptions& options, const std::function<WebReply(const WebRequest&)>& handle);

/// 128 random bits as hexadecimal digits.
/// \throws IoError if the system has none.
std::string random_token();

}  // namespace sidewall::app
