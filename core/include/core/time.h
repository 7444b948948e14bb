// Time: integer nanoseconds in storage and interfaces, double seconds for differences only.
#pragma once

#include <cmath>
#include <cstdint>

namespace plumbline::core {

using TimeNs = std::int64_t;

inline constexpr TimeNs kNsPerSecond = 1'000'000'000;

// A difference of two stamps in seconds; exact below 104 days.
constexpr double to_seconds(TimeNs difference_ns) { return static_cast<double>(difference_ns) * 1e-9; }

// Rounded to the nearest nanosecond.
inline TimeNs to_ns(double seconds) { return std::llround(seconds * 1e9); }

}  // namespace plumbline::core
