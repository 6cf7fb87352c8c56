#pragma once
#include <string_view>

/// Puts a file into the program, so that nothing else is installed: sidewall_NAME to sidewall_NAME_end.
#define SIDEWALL_EMBED(name, path)                                                                \
    __asm__(".section .rodata\n.global sidewall_" #name "\nsidewall_" #name ":\n.incbin \"" path  \
            "\"\n.global sidewall_" #name "_end\nsidewall_" #name "_end:\n.byte 0\n.previous\n"); \
    extern "C" const char sidewall_##name[], sidewall_##name##_end[]

namespace sidewall::app {

/// The text of a file between the two names of SIDEWALL_EMBED.
inline std::string_view embedded(const char* begin, const char* end) {
    return {begin, static_cast<std::size_t>(end - begin)};
}

}  // namespace sidewall::app
