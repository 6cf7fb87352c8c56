#pragma once
#include <string_view>

/// Embeds a file in the program, so that it needs no installed copy: embedded_NAME is its text.
#define SIDEWALL_EMBED(name, path)                                                                \
    __asm__(".section .rodata\n.global sidewall_" #name "\nsidewall_" #name ":\n.incbin \"" path  \
            "\"\n.global sidewall_" #name "_end\nsidewall_" #name "_end:\n.byte 0\n.previous\n"); \
    extern "C" const char sidewall_##name[], sidewall_##name##_end[];                             \
    const std::string_view embedded_##name(sidewall_##name, sidewall_##name##_end)
