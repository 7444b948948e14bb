#include "tools/program.h"

#include <charconv>
#include <cstdio>
#include <exception>
#include <map>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <glog/logging.h>

#include "core/error.h"
#include "tools/ba_command.h"
#include "tools/blas.h"
#include "tools/commands.h"
#include "tools/version.h"

namespace plumbline::tools {
namespace {

template <class T>
std::map<std::string, T> words(const auto& names) {
  std::map<std::string, T> result;
  for (std::size_t i = 0; i < names.size(); ++i) result.emplace(names[i], static_cast<T>(i));
  return result;
}

// I/M with 0 <= I < M.
std::optional<Shard> parse_shard(std::string_view text) {
  Shard shard;
  const char* const end = text.end();
  const auto [slash, error] = std::from_chars(text.begin(), end, shard.index);
  if (error != std::errc() || slash == end || *slash != '/') return std::nullopt;
  const auto [last, error_of] = std::from_chars(slash + 1, end, shard.of);
  if (error_of != std::errc() || last != end || shard.index < 0 || shard.index >= shard.of) return std::nullopt;
  return shard;
}

int parse_and_run(int argc, const char* const* argv) {
  CLI::App app{"Simulation and evaluation of visual-inertial estimators with a time offset and rolling shutter"};
  app.set_version_flag("--version", fmt::format("plumbline {} ({})", version(), commit()));
  app.require_subcommand(1);
  const auto add_set = [](CLI::App* command, std::vector<std::string>& set) {
    command->add_option("--set", set, "override a key, as in scenario.camera.td_s=0.02")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false);
  };

  const auto add_only = [](CLI::App* command, std::vector<std::string>& only) {
    command->add_option("--only", only, "of the cells those alone with this value of an axis; repeat for alternatives")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false);
  };

  RunOptions run_options;
  CLI::App* run_command = app.add_subcommand("run", "simulate, estimate and evaluate an experiment");
  run_command->add_option("EXPERIMENT", run_options.experiment, "experiment file (YAML), or a sweep's folder to go on")
      ->required();
  run_command->add_option("--out", run_options.out, "folder of the results; default out/NAME");
  run_command->add_option("--trials", run_options.trials, "trials of each cell");
  run_command->add_option("--jobs", run_options.jobs, "workers; default one a processor")->check(CLI::PositiveNumber);
  run_command->add_option("--launcher", run_options.launcher, "processes (default), threads or slurm")
      ->transform(CLI::CheckedTransformer(words<Launcher>(kLauncherNames)));
  std::string shard;
  run_command->add_option("--shard", shard, "run only shard I of M (0 <= I < M), to be merged")
      ->type_name("I/M")
      ->check([](const std::string& text) { return parse_shard(text) ? "" : "must be I/M with 0 <= I < M"; });
  const auto add_slurm = [](CLI::App* command, RunOptions& options) {
    command->add_option("--partition", options.partition, "of Slurm");
    command->add_option("--shards", options.shards, "of Slurm, at most; each is at least 30 s of work")
        ->check(CLI::PositiveNumber);
  };
  add_slurm(run_command, run_options);
  run_command->add_flag("--fresh", run_options.fresh, "discard what the folder holds");
  bool run_json = false;
  run_command->add_flag("--json", run_json, "print the summary as JSON");
  add_set(run_command, run_options.set);
  add_only(run_command, run_options.only);

  PlanOptions plan_options;
  CLI::App* plan_command = app.add_subcommand("plan", "write the manifest of an experiment without running it");
  plan_command->add_option("EXPERIMENT", plan_options.experiment, "experiment file (YAML)")->required();
  plan_command->add_option("--out", plan_options.out, "folder of the manifest; default out/NAME");
  plan_command->add_option("--trials", plan_options.trials, "trials of each cell");
  CLI::Option* dry_run = plan_command->add_flag("--dry-run", plan_options.dry_run,
                                                "write nothing; run a trial or two and say how long all will take");
  plan_command->add_option("--jobs", plan_options.jobs, "of that estimate; default one a processor")
      ->check(CLI::PositiveNumber)
      ->needs(dry_run);
  add_set(plan_command, plan_options.set);
  add_only(plan_command, plan_options.only);

  SimulateOptions simulate_options;
  CLI::App* simulate_command = app.add_subcommand("simulate", "write one recording and its truth as a dataset");
  simulate_command->add_option("SCENARIO", simulate_options.scenario, "scenario file (YAML)")->required();
  simulate_command->add_option("--out", simulate_options.out, "folder of the dataset")->required();
  simulate_command->add_option("--seed", simulate_options.seed, "seed of all draws");
  simulate_command->add_option("--trial", simulate_options.trial, "which draw of noise and priors");
  simulate_command->add_flag("--plot", simulate_options.plot,
                             "draw path, world and a frame into plots/ of the dataset");
  add_set(simulate_command, simulate_options.set);

  EstimateOptions estimate_options;
  CLI::App* estimate_command = app.add_subcommand("estimate", "estimate a dataset");
  estimate_command->add_option("DATASET", estimate_options.dataset, "folder of the dataset")->required();
  estimate_command->add_option("--estimator", estimate_options.estimator, "estimator file (YAML)");
  estimate_command->add_option("--out", estimate_options.out, "folder of the estimate")->required();
  add_set(estimate_command, estimate_options.set);

  EvaluateOptions evaluate_options;
  CLI::App* evaluate_command = app.add_subcommand("evaluate", "compare an estimated trajectory with the true one");
  evaluate_command
      ->add_option("ESTIMATE", evaluate_options.estimate, "pose file or folder of an estimate, or a folder of many")
      ->required();
  evaluate_command
      ->add_option("--truth", evaluate_options.truth, "pose file or dataset, or a folder with one for each estimate")
      ->required();
  evaluate_command->add_option("--align", evaluate_options.alignment, "none, posyaw, se3 or sim3")
      ->transform(CLI::CheckedTransformer(words<eval::Alignment>(eval::kAlignmentNames)));
  CLI::Option* first = evaluate_command->add_option("--first", evaluate_options.first_n, "align by the first N poses")
                           ->check(CLI::NonNegativeNumber);
  evaluate_command->add_option("--first-s", evaluate_options.first_s, "align by the poses of the first T seconds")
      ->check(CLI::PositiveNumber)
      ->excludes(first);
  evaluate_command
      ->add_option("--rpe", evaluate_options.deltas,
                   "relative errors over frames (f), seconds, metres or % of the path")
      ->type_name("10m,1s,20f,10%")
      ->capture_default_str();
  evaluate_command->add_option("--std", evaluate_options.deviations,
                               "standard deviations beside OpenVINS's saved states");
  evaluate_command->add_option("--td", evaluate_options.td_s,
                               "the stamps are the camera's clock; move them by this estimated td [s]");
  evaluate_command->add_flag("--json", evaluate_options.json, "print JSON");

  CompareOptions compare_options;
  CLI::App* compare_command = app.add_subcommand("compare", "is B worse than A? paired by cell, trial and seed");
  compare_command->add_option("OUT_A", compare_options.a, "folder of the results of A")->required();
  compare_command->add_option("OUT_B", compare_options.b, "folder of the results of B")->required();
  compare_command->add_option("--metric", compare_options.metrics, "compare this one only; may be repeated")
      ->allow_extra_args(false);
  compare_command->add_option("--alpha", compare_options.alpha, "probability of a false alarm over all tests")
      ->check(CLI::Range(1e-9, 0.5))
      ->capture_default_str();
  compare_command->add_flag("--json", compare_options.json, "print JSON");

  NightlyOptions nightly_options;
  CLI::App* nightly_command = app.add_subcommand("nightly", "run a suite and compare it with an earlier night");
  nightly_command->add_option("SUITE", nightly_options.suite, "suite file (YAML)")->required();
  nightly_command->add_option("--history", nightly_options.history, "SQLite file of all nights; made where missing")
      ->required();
  nightly_command->add_option("--baseline", nightly_options.baseline, "last_green, a tag, or a commit")
      ->capture_default_str();
  nightly_command->add_option("--tag", nightly_options.tag, "a name for this night, for later baselines");
  nightly_command->add_option("--out", nightly_options.out, "folder of this night; default out/nightly/DATE_TIME");
  nightly_command->add_option("--fresh-seed", nightly_options.fresh_seed,
                              "seed of the trials that are new each night; default the time");
  nightly_command->add_flag("--quick", nightly_options.quick, "few trials; compared with quick nights alone");
  nightly_command->add_flag("--across-scenarios", nightly_options.across_scenarios,
                            "compare also experiments whose scenario has changed");
  add_set(nightly_command, nightly_options.set);
  nightly_command->add_option("--jobs", nightly_options.jobs, "workers; default one a processor")
      ->check(CLI::PositiveNumber);

  ExportResultsOptions export_options;
  CLI::App* export_command = app.add_subcommand("export-results", "write the results of a run as one file");
  export_command->add_option("OUT_DIR", export_options.results, "folder of the results")->required();
  export_command->add_option("--format", export_options.format, "csv or sqlite")
      ->required()
      ->transform(CLI::CheckedTransformer(words<ResultsFormat>(kResultsFormatNames)));
  export_command->add_option("--out", export_options.out, "the file, which is replaced")->required();

  ExportOptions dataset_options;
  CLI::App* dataset_command = app.add_subcommand("export", "write a dataset for other programs");
  dataset_command->add_option("DATASET", dataset_options.dataset, "folder of the dataset")->required();
  dataset_command->add_option("--format", dataset_options.format, "tum, euroc, kalibr, openvins, vins or csv")
      ->required()
      ->transform(CLI::CheckedTransformer(words<ExportFormat>(kExportFormatNames)));
  dataset_command->add_option("--out", dataset_options.out, "a new folder")->required();

  ImportOptions import_options;
  CLI::App* import_command = app.add_subcommand("import", "make a scenario of another program's rig");
  import_command
      ->add_option("RIG_FILE", import_options.files,
                   "of Kalibr, OpenVINS or VINS, a folder of EuRoC, or poses (.tum, .txt, .csv)")
      ->required();
  import_command->add_option("--out", import_options.out, "a new scenario file")->required();
  import_command->add_option("--imu-rate", import_options.imu_rate_hz, "Hz, where the files do not state it (VINS)")
      ->check(CLI::PositiveNumber);
  import_command->add_option("--pose-rate", import_options.pose_rate_hz, "Hz, of poses without stamps (KITTI)")
      ->check(CLI::PositiveNumber);

  StatusOptions status_options;
  CLI::App* status_command = app.add_subcommand("status", "what of a sweep is done, failed and missing");
  status_command->add_option("OUT", status_options.out, "folder of the sweep")->required();
  status_command->add_flag("--json", status_options.json, "print JSON");

  MergeOptions merge_options;
  CLI::App* merge_command = app.add_subcommand("merge", "join the shards of a sweep");
  merge_command->add_option("OUT", merge_options.out, "folder of the sweep")->required();
  merge_command->add_flag("--wait", merge_options.wait, "until no other program writes to the folder");
  merge_command->add_flag("--json", merge_options.json, "print the summary as JSON");

  ReportOptions report_options;
  CLI::App* report_command = app.add_subcommand("report", "the results of a sweep as one page, or as Markdown");
  report_command->add_option("OUT", report_options.results, "folder of the sweep")->required();
  report_command->add_option("--format", report_options.format, "html (default) or md")
      ->transform(CLI::CheckedTransformer(words<ReportFormat>(kReportFormatNames)));
  report_command->add_option("--out", report_options.out, "the file; default OUT/report.html, and stdout for Markdown");

  RunOptions resubmit_options;
  resubmit_options.launcher = Launcher::kSlurm;
  CLI::App* resubmit_command = app.add_subcommand("resubmit", "send to Slurm what is missing of a sweep");
  resubmit_command->add_option("OUT", resubmit_options.experiment, "folder of the sweep")
      ->required()
      ->check(CLI::ExistingDirectory);
  add_slurm(resubmit_command, resubmit_options);

  ReplayOptions replay_options;
  CLI::App* replay_command = app.add_subcommand("replay", "run one trial of a sweep again and compare its row");
  replay_command->add_option("OUT", replay_options.results, "folder of the sweep")->required();
  replay_command->add_option("RUN", replay_options.run, "CELL TRIAL, or RUN_ID, as in results.jsonl")
      ->required()
      ->expected(1, 2);
  replay_command->add_option("--dump,--out", replay_options.dump, "write dataset, estimate and series there");

  BaOptions ba_options;
  CLI::App* ba_command = app.add_subcommand("ba", "adjust a bundle: a problem file of BAL");
  ba_command->add_option("PROBLEM", ba_options.problem, "BAL file, plain or bzip2")->required();
  ba_command
      ->add_option("--solver", ba_options.adjustment.solver, "automatic, dense_schur, sparse_schur, iterative_schur")
      ->transform(CLI::CheckedTransformer(words<estimator::BundleSolver>(estimator::kBundleSolverNames)));
  ba_command
      ->add_option("--rotation", ba_options.adjustment.rotation, "perturbation: angle_axis (as in the file) or left")
      ->transform(CLI::CheckedTransformer(words<estimator::BundleRotation>(estimator::kBundleRotationNames)));
  ba_command->add_option("--iterations", ba_options.adjustment.max_iterations, "at most so many steps")
      ->check(CLI::PositiveNumber);
  ba_command->add_option("--threads", ba_options.adjustment.threads, "threads of the solver")
      ->check(CLI::PositiveNumber);
  ba_command->add_option("--truth", ba_options.truth,
                         "true cameras and points (BAL file), compared after Sim3 alignment");
  ba_command->add_option("--out", ba_options.out, "write the adjusted problem; compressed where it ends in .bz2");
  ba_command->add_flag("--json", ba_options.json, "print JSON");

  SimulateBaOptions simulate_ba_options;
  sim::BalWorldConfig& bal_world = simulate_ba_options.world;
  CLI::App* simulate_ba_command =
      app.add_subcommand("simulate-ba", "write a bundle problem and its truth as BAL files");
  simulate_ba_command->add_option("--out", simulate_ba_options.out, "folder for problem.txt and truth.txt")->required();
  simulate_ba_command->add_option("--seed", simulate_ba_options.seed, "seed of all draws");
  simulate_ba_command->add_option("--cameras", bal_world.cameras, "cameras on a ring")->check(CLI::Range(3, 100000));
  simulate_ba_command->add_option("--points", bal_world.points, "points inside the ring")
      ->check(CLI::Range(10, 100000000));
  simulate_ba_command->add_option("--pixel-sigma-px", bal_world.pixel_sigma_px, "noise of an observation")
      ->check(CLI::NonNegativeNumber);

  CheckOptions check_options;
  CLI::App* check_command = app.add_subcommand("check", "check configuration files");
  CLI::Option* configs =
      check_command->add_option("CONFIG", check_options.files, "experiments, scenarios or estimators");
  check_command->add_flag("--keys", check_options.keys, "print all keys with defaults and rules");
  add_set(check_command, check_options.set);
  check_command->get_option("--set")->needs(configs);
  check_command->require_option(1, 0);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitBadInput;
  }
  run_options.shard = parse_shard(shard);
  if (run_json) run_options.output = SummaryOutput::kJson;
  if (*run_command) return run(run_options);
  if (*plan_command) return plan(plan_options);
  if (*resubmit_command) return run(resubmit_options);
  if (*status_command) return status(status_options);
  if (*merge_command) return merge(merge_options);
  if (*report_command) return report(report_options);
  if (*simulate_command) return simulate(simulate_options);
  if (*estimate_command) return estimate(estimate_options);
  if (*evaluate_command) return evaluate(evaluate_options);
  if (*compare_command) return compare(compare_options);
  if (*nightly_command) return nightly(nightly_options);
  if (*export_command) return export_results(export_options);
  if (*dataset_command) return export_dataset(dataset_options);
  if (*import_command) return import_rig(import_options);
  if (*replay_command) return replay(replay_options);
  if (*ba_command) return ba(ba_options);
  if (*simulate_ba_command) return simulate_ba(simulate_ba_options);
  return check(check_options);
}

}  // namespace

int program(int argc, const char* const* argv) {
  use_one_blas_thread();
  // Ceres warns of every step that it rejects; what matters comes back as a status.
  FLAGS_minloglevel = google::GLOG_FATAL;
  try {
    return parse_and_run(argc, argv);
  } catch (const core::InputError& error) {
    fmt::print(stderr, "plumbline: {}\n", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline: internal error: {}\n", error.what());
    return kExitInternal;
  }
}

}  // namespace plumbline::tools
