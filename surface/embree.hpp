#pragma once
// Embree 4 where it is installed, else Embree 3, whose query context the functions below fill in.
#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace sidewall::surface {

#if RTC_VERSION_MAJOR >= 4

inline void intersect(RTCScene scene, RTCRayHit& query) {
    rtcIntersect1(scene, &query);
}
inline void intersect(const int* active, RTCScene scene, RTCRayHit8& query) {
    rtcIntersect8(active, scene, &query);
}
inline void intersect(const int* active, RTCScene scene, RTCRayHit16& query) {
    rtcIntersect16(active, scene, &query);
}
inline void find_any(RTCScene scene, RTCRay& query) {
    rtcOccluded1(scene, &query);
}
inline void find_any(const int* active, RTCScene scene, RTCRay8& query) {
    rtcOccluded8(active, scene, &query);
}

#else

inline RTCIntersectContext plain_context() {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    return context;
}
inline void intersect(RTCScene scene, RTCRayHit& query) {
    RTCIntersectContext context = plain_context();
    rtcIntersect1(scene, &context, &query);
}
inline void intersect(const int* active, RTCScene scene, RTCRayHit8& query) {
    RTCIntersectContext context = plain_context();
    rtcIntersect8(active, scene, &context, &query);
}
inline void intersect(const int* active, RTCScene scene, RTCRayHit16& query) {
    RTCIntersectContext context = plain_context();
    rtcIntersect16(active, scene, &context, &query);
}
inline void find_any(RTCScene scene, RTCRay& query) {
    RTCIntersectContext context = plain_context();
    rtcOccluded1(scene, &context, &query);
}
inline void find_any(const int* active, RTCScene scene, RTCRay8& query) {
    RTCIntersectContext context = plain_context();
    rtcOccluded8(active, scene, &context, &query);
}

#endif

}  // namespace sidewall::surface
