#include "app/workbench/web_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <future>
#include <random>
#include <string>
#include <thread>
#include <vector>

// The server's answers and refusals, with requests written byte for byte.
namespace {

using sidewall::app::WebReply;
using sidewall::app::WebRequest;

const std::string kToken = "00112233445566778899aabbccddeeff";

// A server of one page, in a thread of its own.
class Server {
  public:
    Server() {
        std::promise<std::string> listening;
        thread_ = std::thread([this, &listening] {
            sidewall::app::serve({.port = 0,
                                  .token = kToken,
                                  .on_listening = [&](const std::string& a) { listening.set_value(a); },
                                  .stop = [this] { return stop_.load(); }},
                                 [this](const WebRequest& request) {
                                     ++handled;
                                     if (request.path == "/large")
                                         return WebReply{.body = std::string(12'000'000, 'x')};
                                     if (request.path == "/throws") throw std::runtime_error("no luck");
                                     return WebReply{.body = request.path};
                                 });
        });
        const std::string address = listening.get_future().get();
        const std::size_t colon = address.rfind(':');
        port = static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1)));
        CHECK(address == "http://127.0.0.1:" + std::to_string(port) + "/?key=" + kToken);
    }
    ~Server() {
        stop_ = true;
        thread_.join();
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    std::uint16_t port = 0;
    std::atomic<int> handled = 0;

    std::string host() const { return "127.0.0.1:" + std::to_string(port); }
    std::string cookie() const { return "sidewall_" + std::to_string(port) + "=" + kToken; }

    // A request with further lines of header, or with other lines in place of Host and Cookie.
    std::string request(const std::string& target, const std::string& more = "",
                        const std::string& host_line = "", const std::string& cookie_line = "") const {
        return "GET " + target + " HTTP/1.1\r\nHost: " + (host_line.empty() ? host() : host_line) +
               "\r\nCookie: " + (cookie_line.empty() ? cookie() : cookie_line) + "\r\n" + more + "\r\n";
    }

  private:
    std::atomic<bool> stop_ = false;
    std::thread thread_;
};

int connected(std::uint16_t port) {
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(port);
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{.tv_sec = 20, .tv_usec = 0};
    const int little = 65'536;  // bytes that the client's side buffers
    setsockopt(client, SOL_SOCKET, SO_RCVBUF, &little, sizeof little);
    setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    REQUIRE(connect(client, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0);
    return client;
}

std::string all_from(int client) {
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t n = 0; (n = recv(client, part.data(), part.size(), 0)) > 0;)
        text.append(part.data(), static_cast<std::size_t>(n));
    return text;
}

// The server's answer to these bytes.
std::string answer(std::uint16_t port, const std::string& bytes) {
    const int client = connected(port);
    if (send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL) >= 0) shutdown(client, SHUT_WR);
    const std::string text = all_from(client);
    close(client);
    return text;
}

// The status of an answer; 0: none.
int status(const std::string& answer) {
    return answer.starts_with("HTTP/1.") ? std::stoi(answer.substr(9)) : 0;
}

}  // namespace

TEST_CASE("only a browser with the token, on this machine's own address and origin, is answered",
          "[foreign]") {
    const Server server;
    const auto asked = [&](const std::string& request) { return status(answer(server.port, request)); };
    const std::string here = server.host(), other = "sidewall_" + std::to_string(server.port) + "=" +
                                                    std::string(kToken.size(), '0');
    CHECK(asked(server.request("/")) == 200);
    CHECK(asked(server.request("/", "", "localhost:" + std::to_string(server.port))) == 200);
    CHECK(asked(server.request("/", "Origin: http://" + here + "\r\n")) == 200);
    const std::string first = answer(server.port, server.request("/?key=" + kToken, "", "", "none"));
    CHECK(status(first) == 200);
    CHECK(first.find("Set-Cookie: " + server.cookie() + "; Path=/; SameSite=Strict; HttpOnly") !=
          std::string::npos);
    const int handled = server.handled;
    // No token, or another one; a key in the address of anything but the page.
    CHECK(asked(server.request("/", "", "", "none")) == 403);
    CHECK(asked(server.request("/", "", "", other)) == 403);
    CHECK(asked(server.request("/?key=" + kToken.substr(1), "", "", "none")) == 403);
    CHECK(asked(server.request("/api/contents?key=" + kToken, "", "", "none")) == 403);
    // Host names that another site may let resolve to this machine, another port, no host, two hosts.
    for (const std::string host : {"evil.example", "127.0.0.1", "127.0.0.1:1", "evil.example:80", "0.0.0.0"})
        CHECK(asked(server.request("/", "", host)) == 403);
    CHECK(asked("GET / HTTP/1.0\r\nCookie: " + server.cookie() + "\r\n\r\n") == 403);
    CHECK(asked(server.request("/", "Host: evil.example\r\n")) >= 400);
    // Pages of other sites.
    for (const std::string origin :
         {"http://evil.example", "null", "https://127.0.0.1:1", "http://127.0.0.1"})
        CHECK(asked(server.request("/", "Origin: " + origin + "\r\n")) == 403);
    CHECK(asked(server.request("/", "Sec-Fetch-Site: cross-site\r\n")) == 403);
    CHECK(asked(server.request("/", "Sec-Fetch-Site: same-site\r\n")) == 403);
    CHECK(server.handled == handled);
}

TEST_CASE("an exception of a page's maker is status 500 and the server goes on", "[foreign]") {
    const Server server;
    CHECK(status(answer(server.port, server.request("/throws"))) == 500);
    CHECK(status(answer(server.port, server.request("/"))) == 200);
}

TEST_CASE("a request that is too large is refused before it is read", "[foreign]") {
    const Server server;
    CHECK(status(answer(server.port, server.request("/", "X: " + std::string(20'000, 'x') + "\r\n"))) == 431);
    CHECK(status(answer(server.port, server.request("/", "Content-Length: 4000000000\r\n"))) == 413);
    CHECK(server.handled == 0);
    CHECK(status(answer(server.port, server.request("/"))) == 200);
}

TEST_CASE("a request that is refused is answered before its body has come", "[foreign]") {
    const Server server;
    const std::string announced = "Content-Length: 3000000\r\n";
    CHECK(status(answer(server.port, server.request("/api/save", announced, "", "none"))) == 403);
    CHECK(status(answer(server.port, server.request("/api/save", announced, "evil.example"))) == 403);
    CHECK(status(answer(server.port, server.request("/api/save", announced))) == 0);  // waits for the body
    CHECK(server.handled == 0);
}

TEST_CASE("what all requests and answers hold is bounded: beyond it a client is told to ask again",
          "[foreign]") {
    const Server server;
    const auto begun = [&](const std::string& request) {
        const int client = connected(server.port);
        CHECK(send(client, request.data(), request.size(), MSG_NOSIGNAL) > 0);
        return client;
    };
    const auto first_status = [](int client) {
        std::array<char, 12> line{};
        const bool whole = recv(client, line.data(), line.size(), MSG_WAITALL) == 12;
        return whole ? std::stoi(std::string(line.data() + 9, 3)) : 0;
    };
    // Answers of 12 MB that nobody reads: two fit into the bound.
    std::vector<int> clients;
    int taken = 0, refused = 0;
    for (int k = 0; k < 40; ++k) clients.push_back(begun(server.request("/large")));
    for (const int client : clients) {
        const int code = first_status(client);
        taken += code == 200;
        refused += code == 503;
    }
    CHECK(taken == 2);
    CHECK(refused == 38);
    CHECK(status(answer(server.port, server.request("/"))) == 200);
    for (const int client : clients) close(client);
    int again = 503;
    for (int k = 0; k < 200 && again == 503; ++k) {
        usleep(10'000);
        again = status(answer(server.port, server.request("/large")));
    }
    CHECK(again == 200);
    // Announced bodies that do not arrive: two of 3 MB fit, as each counts three times.
    clients.clear();
    const std::string announced = server.request("/api/save", "Content-Length: 3000000\r\n");
    for (int k = 0; k < 2; ++k) clients.push_back(begun(announced));
    int third = 0;
    for (int k = 0; k < 200 && third != 503; ++k) {
        usleep(10'000);
        third = status(answer(server.port, announced));
    }
    CHECK(third == 503);
    CHECK(status(answer(server.port, server.request("/", "Content-Length: 5\r\n") + "hello")) == 200);
    for (const int client : clients) close(client);
}

TEST_CASE("a thousand damaged requests are refused or dropped, and the next good one is answered",
          "[foreign]") {
    const Server server;
    std::mt19937 random(1);
    const std::string good = server.request("/api/text?path=a.toml", "Content-Length: 5\r\n") + "hello";
    int refused = 0, dropped = 0, answered = 0;
    for (int k = 0; k < 1000; ++k) {
        std::string bytes = good.substr(0, random() % 4 == 0 ? random() % good.size() : good.size());
        for (unsigned n = 1 + random() % 8; n > 0 && !bytes.empty(); --n)
            bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
        const int code = status(answer(server.port, bytes));
        ++(code == 200 ? answered : code == 0 ? dropped : refused);
        CHECK((code == 0 || code == 200 || (code >= 400 && code < 500)));
    }
    CAPTURE(refused, dropped, answered);
    CHECK(refused > 300);
    CHECK(status(answer(server.port, server.request("/"))) == 200);
}

TEST_CASE("clients that send a byte now and then hold up nobody, and are dropped in time",
          "[foreign][slow]") {
    const Server server;
    std::vector<int> slow;
    for (int k = 0; k < 63; ++k) slow.push_back(connected(server.port));
    const auto begin = std::chrono::steady_clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
    bool open = true;
    while (open && seconds() < 60.0) {
        for (const int client : slow) send(client, "G", 1, MSG_NOSIGNAL);
        const auto asked = std::chrono::steady_clock::now();
        CHECK(status(answer(server.port, server.request("/"))) == 200);
        CHECK(std::chrono::steady_clock::now() - asked < std::chrono::seconds(5));
        std::this_thread::sleep_for(std::chrono::seconds(1));
        open = false;
        for (const int client : slow) {
            char byte = 0;
            const ssize_t got = recv(client, &byte, 1, MSG_DONTWAIT);
            open |= got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
        }
    }
    CHECK(seconds() < 40.0);
    for (const int client : slow) close(client);
}

TEST_CASE("a token has 128 bits and is another one each time") {
    const std::string one = sidewall::app::random_token();
    CHECK(one.size() == 32);
    CHECK(one.find_first_not_of("0123456789abcdef") == std::string::npos);
    CHECK(one != sidewall::app::random_token());
}
