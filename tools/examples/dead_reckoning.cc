// An external estimator in C++: where the frames were taken by the IMU alone, from the prior's state on.
//   dead_reckoning --dataset DIR --out DIR
//   t_imu = t_cam + td    with the prior's td (of the middle row); poses are written in the camera's clock
// g++ -O2 -I/usr/include/eigen3 dead_reckoning.cc -o dead_reckoning -lyaml-cpp
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <yaml-cpp/yaml.h>

struct Sample {
  long long t_ns = 0;
  Eigen::Vector3d rate, force;
};

struct State {
  Eigen::Quaterniond q;
  Eigen::Vector3d p, v;
};

static Eigen::Vector3d vector(const YAML::Node& n) { return Eigen::Vector3d(n.as<std::vector<double>>().data()); }

static std::vector<Sample> read_csv(const std::string& file) {
  std::vector<Sample> rows;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('#')) continue;
    Sample& s = rows.emplace_back();
    char comma = 0;
    std::istringstream fields(line);
    fields >> s.t_ns;
    for (double* x : {&s.rate[0], &s.rate[1], &s.rate[2], &s.force[0], &s.force[1], &s.force[2]}) fields >> comma >> *x;
  }
  return rows;
}

// From the sample a to b, dt seconds later, the readings linear between them.
static State step(const State& x, const Sample& a, const Sample& b, double dt, const Sample& bias, double gravity) {
  const Eigen::Vector3d turn = dt * (0.5 * (a.rate + b.rate) - bias.rate);
  State y;
  y.q = x.q * Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()));
  const Eigen::Vector3d acceleration =
      0.5 * (x.q * (a.force - bias.force) + y.q * (b.force - bias.force)) - gravity * Eigen::Vector3d::UnitZ();
  y.p = x.p + dt * (x.v + 0.5 * dt * acceleration);
  y.v = x.v + dt * acceleration;
  return y;
}

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::string dataset = argv[2], out = argv[4];
  const double gravity = YAML::LoadFile(dataset + "/meta.yaml")["gravity_m_s2"].as<double>();
  const YAML::Node prior = YAML::LoadFile(dataset + "/prior.yaml"), mean = prior["mean"];
  const double td_s = prior["calibration"]["td_s"].as<double>();
  const Sample bias{0, vector(mean["gyro_bias_rad_s"]), vector(mean["accel_bias_m_s2"])};
  State state{Eigen::Quaterniond(mean["T_W_B"]["quaternion_xyzw"].as<std::vector<double>>().data()),
              vector(mean["T_W_B"]["position_m"]), vector(mean["velocity_m_s"])};
  const auto imu = read_csv(dataset + "/mav0/imu0/data.csv"), frames = read_csv(dataset + "/mav0/cam0/data.csv");
  std::FILE* poses = std::fopen((out + "/estimate.tum").c_str(), "w");
  for (std::size_t i = 0, k = 0; i + 1 < imu.size(); ++i) {
    const Sample &a = imu[i], &b = imu[i + 1];
    if (a.t_ns < prior["t_ns"].as<long long>()) continue;
    for (long long t; k < frames.size() && (t = frames[k].t_ns + std::llround(1e9 * td_s)) < b.t_ns; ++k) {
      const double dt = 1e-9 * double(t - a.t_ns), s = dt / (1e-9 * double(b.t_ns - a.t_ns));
      const Sample c{t, a.rate + s * (b.rate - a.rate), a.force + s * (b.force - a.force)};
      const State x = step(state, a, c, dt, bias, gravity);
      std::fprintf(poses, "%lld.%09lld %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", frames[k].t_ns / 1000000000,
                   frames[k].t_ns % 1000000000, x.p.x(), x.p.y(), x.p.z(), x.q.x(), x.q.y(), x.q.z(), x.q.w());
    }
    state = step(state, a, b, 1e-9 * double(b.t_ns - a.t_ns), bias, gravity);
  }
  std::fclose(poses);
  std::ofstream(out + "/meta.yaml") << "stamp_clock: camera\ntd_s: " << prior["calibration"]["td_s"].as<std::string>()
                                    << "\ntd_reference_row: middle\n";
}
