#pragma once
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

namespace sidewall::levelset {

/// Allocates memory for arrays of a grid's size, not cleared. A few blocks that were given back are kept for
/// the next time step: having the system clear new ones takes longer than the work on them. Thread-safe.
/// \throws std::bad_alloc
void* take_memory(std::size_t bytes);
/// Returns memory of take_memory. \param bytes  the number that it was taken with.
void give_back_memory(void* memory, std::size_t bytes);
/// Frees the kept blocks: for use before work that needs much memory.
void drop_kept_memory();

template <class T>
struct LargeAllocator {
    static_assert(std::is_trivially_destructible_v<T>);
    using value_type = T;

    LargeAllocator() = default;
    template <class U>
    LargeAllocator(const LargeAllocator<U>&) {}
    T* allocate(std::size_t count) { return static_cast<T*>(take_memory(count * sizeof(T))); }
    void deallocate(T* memory, std::size_t count) { give_back_memory(memory, count * sizeof(T)); }
    template <class U>
    void construct(U*) {}
    template <class U, class... Arguments>
    void construct(U* at, Arguments&&... arguments) {
        ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
    bool operator==(const LargeAllocator&) const { return true; }
};

/// A vector whose new elements stay uninitialised unless a value is given.
template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace sidewall::levelset
