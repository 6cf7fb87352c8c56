#include "app/workbench/web_server.hpp"

#include <fmt/format.h>

#include <sys/random.h>
#include <array>
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <memory>
#include <optional>
#include <utility>

#include "app/common/text.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = asio::ip::tcp;
using Seconds = std::chrono::seconds;

constexpr std::uint32_t kMostHeader = 16'384;
constexpr std::uint64_t kMostBody = 4'000'000;
constexpr std::size_t kMostHeld = 24'000'000;  // bytes that all requests and answers may hold
constexpr std::size_t kLittle = 100'000;       // bytes; up to so many are never refused
constexpr std::size_t kCopies = 3;             // copies of a request: bytes, JSON, and what is made of it
constexpr int kMostConnections = 64;
constexpr std::size_t kThreads = 16;  // threads; at most two wait for processes of run_self
constexpr Seconds kToArrive{20}, kToBeTaken{60};

// Decodes percent-encoded text; nothing if the encoding is damaged.
std::optional<std::string> decoded(std::string_view text) {
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            plain += text[i] == '+' ? ' ' : text[i];
            continue;
        }
        const std::string_view digits = text.substr(i + 1, 2);
        std::uint8_t code = 0;
        if (digits.size() < 2 || !surface::read_number(digits, code, 16)) return std::nullopt;
        plain += static_cast<char>(code);
        i += 2;
    }
    return plain;
}

// Reads path and query of a request target; false if it is malformed.
bool read_target(std::string_view target, WebRequest& request) {
    const std::size_t mark = target.find('?');
    const auto path = decoded(target.substr(0, mark));
    if (!path || !path->starts_with('/')) return false;
    request.path = *path;
    if (mark == std::string_view::npos) return true;
    for (const std::string& pair : split(target.substr(mark + 1), '&')) {
        const std::size_t equals = std::min(pair.find('='), pair.size());
        const auto name = decoded(pair.substr(0, equals));
        const auto value = decoded(pair.substr(std::min(equals + 1, pair.size())));
        if (!name || !value) return false;
        auto [place, fresh] = request.query.try_emplace(*name, *value);
        if (!fresh) place->second += '\0' + *value;
    }
    return true;
}

// Compares in a time that does not depend on how much of the texts agrees.
bool same_secret(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned differ = 0;
    for (std::size_t i = 0; i < a.size(); ++i) differ |= static_cast<unsigned char>(a[i] ^ b[i]);
    return differ == 0;
}

struct Shared {
    WebOptions options;
    std::function<WebReply(const WebRequest&)> handle;
    asio::thread_pool workers{kThreads};
    std::atomic<int> connections = 0;
    std::atomic<std::size_t> held = 0;

    std::string cookie() const { return fmt::format("sidewall_{}", options.port); }
};

using Request = http::request<http::string_body>;

std::string header(const Request& request, http::field name) {
    const auto value = request[name];
    return {value.data(), value.size()};
}

// Whether a request comes from a page of this server, or from no page. With the token any page may have sent
// the user here, such as the file that opens a browser.
bool from_here(const Request& request, std::uint16_t port, bool has_token) {
    const std::string host = header(request, http::field::host),
                      origin = header(request, http::field::origin);
    const auto fetch = request["Sec-Fetch-Site"];
    return (host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port)) &&
           request.count(http::field::host) == 1 && (origin.empty() || origin == "http://" + host) &&
           (has_token || fetch.empty() || fetch == "same-origin" || fetch == "none");
}

bool has_cookie(const Request& request, const Shared& shared) {
    for (const std::string& pair : split(header(request, http::field::cookie), ';')) {
        const std::string_view cookie = trimmed(pair);
        const std::size_t equals = cookie.find('=');
        if (equals != std::string_view::npos && cookie.substr(0, equals) == shared.cookie() &&
            same_secret(cookie.substr(equals + 1), shared.options.token))
            return true;
    }
    return false;
}

http::response<http::string_body> response_of(WebReply reply, unsigned version) {
    http::response<http::string_body> response(static_cast<http::status>(reply.status), version);
    response.set(http::field::content_type, reply.type);
    response.set(http::field::cache_control, "no-store");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("X-Frame-Options", "DENY");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set("Referrer-Policy", "no-referrer");
    response.body() = std::move(reply.body);
    response.keep_alive(false);
    return response;
}

WebReply plain(int status, std::string text) {
    return {.status = status, .type = "text/plain; charset=utf-8", .body = std::move(text)};
}

// A request after its header was read.
struct Asked {
    WebRequest wanted;
    bool first = false;               // the token is in the address, as printed
    std::optional<WebReply> refused;  // the answer if it is refused
};

Asked asked_by(const Request& header, const Shared& shared) {
    Asked asked;
    const auto method = header.method_string();
    asked.wanted.method = {method.data(), method.size()};
    if (!read_target({header.target().data(), header.target().size()}, asked.wanted)) {
        asked.refused = plain(400, "not a request\n");
        return asked;
    }
    asked.first = asked.wanted.path == "/" && same_secret(asked.wanted.query["key"], shared.options.token);
    if (!from_here(header, shared.options.port, asked.first))
        asked.refused = plain(403, "refused: another host or origin\n");
    else if (!asked.first && !has_cookie(header, shared))
        asked.refused = plain(403, "refused: open the address that `sidewall open` printed\n");
    else if (asked.wanted.method != "GET" && asked.wanted.method != "POST")
        asked.refused = plain(405, "GET or POST\n");
    return asked;
}

http::response<http::string_body> answer(Request& request, Asked& asked, const Shared& shared) {
    asked.wanted.body = std::move(request.body());
    WebReply reply;
    try {
        reply = shared.handle(asked.wanted);
    } catch (const std::exception& error) {
        reply = plain(500, fmt::format("{}\n", error.what()));
    }
    auto response = response_of(std::move(reply), request.version());
    if (asked.first)
        response.set(http::field::set_cookie, fmt::format("{}={}; Path=/; SameSite=Strict; HttpOnly",
                                                          shared.cookie(), shared.options.token));
    return response;
}

// A connection: one request, one answer. The body is read once the header has passed all checks. A deadline
// holds for the whole request and one for the whole answer, however slowly bytes come or go.
class Connection : public std::enable_shared_from_this<Connection> {
  public:
    Connection(Tcp::socket&& socket, Shared& shared) : stream_(std::move(socket)), shared_(shared) {
        ++shared_.connections;
        parser_.header_limit(kMostHeader);
        parser_.body_limit(kMostBody);
    }
    ~Connection() {
        hold(0);
        --shared_.connections;
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void begin() {
        stream_.expires_after(kToArrive);
        http::async_read_header(
            stream_, buffer_, parser_,
            [self = shared_from_this()](beast::error_code error, std::size_t) { self->on_header(error); });
    }

  private:
    void on_header(beast::error_code error) {
        if (refuses(error)) return;
        asked_ = asked_by(parser_.get(), shared_);
        if (asked_.refused) return write(response_of(*asked_.refused, kVersion));
        const std::uint64_t size =
            parser_.chunked() ? kMostBody : parser_.content_length().value_or(std::uint64_t{0});
        if (!hold(kCopies * size)) return write(busy());
        http::async_read(
            stream_, buffer_, parser_,
            [self = shared_from_this()](beast::error_code failure, std::size_t) { self->on_read(failure); });
    }

    // Sets the bytes that this connection holds; false if all connections together would hold too many.
    bool hold(std::size_t bytes) {
        shared_.held -= std::exchange(held_, 0);
        if ((shared_.held += bytes) <= kMostHeld || bytes <= kLittle) {
            held_ = bytes;
            return true;
        }
        shared_.held -= bytes;
        return false;
    }

    static http::response<http::string_body> busy() {
        return response_of(plain(503, "busy with other requests: try again\n"), kVersion);
    }

    // Whether reading failed; answers malformed and oversized requests.
    bool refuses(beast::error_code error) {
        if (error == http::error::body_limit)
            write(response_of(plain(413, "too large\n"), kVersion));
        else if (error == http::error::header_limit)
            write(response_of(plain(431, "too large\n"), kVersion));
        else if (error.category() == http::make_error_code(http::error::bad_method).category() &&
                 error != http::error::end_of_stream && error != http::error::partial_message)
            write(response_of(plain(400, "not a request\n"), kVersion));
        return bool(error);  // without an answer: the peer has gone or was too slow
    }

    void on_read(beast::error_code error) {
        if (refuses(error)) return;
        stream_.expires_never();
        asio::post(shared_.workers, [self = shared_from_this()] {
            auto response = answer(self->parser_.get(), self->asked_, self->shared_);
            if (!self->hold(response.body().size())) response = busy();
            asio::post(self->stream_.get_executor(),
                       [self, made = std::move(response)]() mutable { self->write(std::move(made)); });
        });
    }

    void write(http::response<http::string_body>&& response) {
        response_ = std::move(response);
        response_.prepare_payload();
        stream_.expires_after(kToBeTaken);
        http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
            beast::error_code ignored;
            self->stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
        });
    }

    static constexpr unsigned kVersion = 11;
    beast::tcp_stream stream_;
    Shared& shared_;
    beast::flat_buffer buffer_;
    http::request_parser<http::string_body> parser_;
    Asked asked_;
    std::size_t held_ = 0;
    http::response<http::string_body> response_;
};

class Listener {
  public:
    Listener(asio::io_context& context, Shared& shared)
        : context_(context), acceptor_(context), timer_(context), shared_(shared) {
        const Tcp::endpoint here(asio::ip::address_v4::loopback(), shared.options.port);
        beast::error_code error;
        acceptor_.open(here.protocol(), error);
        if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
        if (!error) acceptor_.bind(here, error);
        if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
        if (error)
            throw IoError("127.0.0.1:{}: cannot use this port: {}; choose another --port",
                          shared.options.port, error.message());
        shared.options.port = acceptor_.local_endpoint().port();
    }

    void begin() {
        accept();
        watch();
    }

  private:
    void accept() {
        acceptor_.async_accept([this](beast::error_code error, Tcp::socket socket) {
            if (error == asio::error::operation_aborted) return;
            if (!error && shared_.connections < kMostConnections)
                std::make_shared<Connection>(std::move(socket), shared_)->begin();
            accept();
        });
    }

    void watch() {
        timer_.expires_after(std::chrono::milliseconds(100));
        timer_.async_wait([this](beast::error_code) {
            if (shared_.options.stop && shared_.options.stop())
                context_.stop();
            else
                watch();
        });
    }

    asio::io_context& context_;
    Tcp::acceptor acceptor_;
    asio::steady_timer timer_;
    Shared& shared_;
};

}  // namespace

void serve(const WebOptions& options, const std::function<WebReply(const WebRequest&)>& handle) {
    Shared shared{.options = options, .handle = handle};
    asio::io_context context(1);
    Listener listener(context, shared);
    if (options.on_listening)
        options.on_listening(fmt::format("http://127.0.0.1:{}/?key={}", shared.options.port, options.token));
    listener.begin();
    context.run();
    shared.workers.join();
}

std::string random_token() {
    std::array<unsigned char, 16> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        throw IoError("the system gives no random numbers: {}", std::string("getrandom failed"));
    std::string token;
    for (const unsigned char byte : bytes) token += fmt::format("{:02x}", byte);
    return token;
}

}  // namespace sidewall::app
