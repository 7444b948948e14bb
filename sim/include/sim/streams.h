// The purposes of all random streams of the simulator (core/random.h), so that a test can show that no two of them are
// related. The same test finds a stream that is missing here.
#pragma once

#include <array>
#include <string_view>

namespace plumbline::sim {

inline constexpr auto kStreams = std::to_array<std::string_view>({
    "bal/camera",
    "bal/pixel",
    "bal/point",
    "bal/start_camera",
    "bal/start_point",
    "cam0/frame_drop",
    "cam0/gross_outlier",
    "cam0/gross_outlier_offset",
    "cam0/line_break",
    "cam0/line_loss",
    "cam0/line_match",
    "cam0/line_noise",
    "cam0/line_slide",
    "cam0/pixel_noise",
    "cam0/stamp_jitter",
    "cam0/track_loss",
    "cam0/trigger_jitter",
    "cam0/uniform_outlier",
    "cam0/uniform_outlier_pixel",
    "imu0/accel_walk",
    "imu0/accel_white",
    "imu0/dropout",
    "imu0/gyro_walk",
    "imu0/gyro_white",
    "imu0/stamp_jitter",
    "prior/mean",
    "prior/start",
    "trajectory/handheld",
    "world/corridor",
    "world/doors",
    "world/frustum",
    "world/line_order",
    "world/lines",
    "world/planes",
    "world/planes_landmarks",
    "world/rooms",
    "world/shell",
});

}  // namespace plumbline::sim
