#pragma once
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

namespace sidewall::levelset {

/// Memory of a grid's size, not cleared. A few blocks that were given back are kept for the next time step, which needs as
/// many: to have the system clear new ones takes longer than what is done with them. Any thread.
/// \throws std::bad_alloc
void* take_memory(std::size_t bytes);
/// \param bytes  as it was taken for.
void give_back_memory(void* memory, std::size_t bytes);
/// Gives the system what is kept: before work that takes much by itself.
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

/// A vector whose new elements are not set unless to a given value.
template <class T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace sidewall::levelset
