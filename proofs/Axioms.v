(** Print the axioms of the theorems that the kernel rests on, those of a file together.

    Behind a theorem stand the kernel's modules, classes and functions whose rule it is; those without are steps
    to others, or say what definitions mean. *)

From LtlPlan Require Bernstein Crossing Halves Tree Regions Rules Margins Elimination Farkas Pairs Hoops
  Intervals Sines Rotors Instants Progression Counts Invariant Endless Laps Clocks Timeline.

Definition of_Bernstein := (
  Bernstein.bern_sum,
  Bernstein.bern_power,
  Bernstein.bern_from_powers, (* bernstein *)
  Bernstein.bern_nonneg,
  Bernstein.bern_positive, (* Bernstein *)
  Bernstein.bern_lower, (* Bernstein *)
  Bernstein.bern_upper). (* Bernstein *)
Print Assumptions of_Bernstein.

Definition of_Crossing := (
  Crossing.crossing_in, (* Cell *)
  Crossing.crossing_out). (* Cell *)
Print Assumptions of_Crossing.

Definition of_Halves := (
  Halves.first_half_value, (* halves *)
  Halves.second_half_value). (* halves *)
Print Assumptions of_Halves.

Definition of_Tree := (
  Tree.check_tree_sound, (* trees *)
  Tree.tiles_cover).
Print Assumptions of_Tree.

Definition of_Regions := (
  Regions.check_region_sound, (* holds *)
  Regions.must_tube, (* region *)
  Regions.no_tube, (* region *)
  Regions.across_face, (* bodies *)
  Regions.faces_meet, (* meet *)
  Regions.needless_face). (* holds *)
Print Assumptions of_Regions.

Definition of_Rules := (
  Rules.check_rules_sound). (* holds *)
Print Assumptions of_Rules.

Definition of_Margins := (
  Margins.half_space_must, (* zones *)
  Margins.half_space_no, (* zones *)
  Margins.quadric_must, (* zones *)
  Margins.quadric_no, (* obstacle, zones *)
  Margins.rows_grow, (* _scale *)
  Margins.rest_grows). (* _scale *)
Print Assumptions of_Margins.

Definition of_Elimination := (
  Elimination.elimination_semidefinite, (* pivots *)
  Elimination.square_completed). (* asked *)
Print Assumptions of_Elimination.

Definition of_Farkas := (
  Farkas.farkas_keeps, (* obstacle *)
  Farkas.farkas_ball). (* obstacle *)
Print Assumptions of_Farkas.

Definition of_Pairs := (
  Pairs.plane_parts, (* Two *)
  Pairs.apart_moved, (* Pair *)
  Pairs.stretched_grows, (* Pair *)
  Pairs.flown). (* drift *)
Print Assumptions of_Pairs.

Definition of_Hoops := (
  Hoops.before_plane, (* opening *)
  Hoops.behind_plane, (* opening *)
  Hoops.beside_opening, (* opening *)
  Hoops.inside_opening, (* opening *)
  Hoops.passes_disc, (* _passages *)
  Hoops.passes_once, (* _passages *)
  Hoops.apart_ahead, (* apart *)
  Hoops.rim_clear). (* rim *)
Print Assumptions of_Hoops.

Definition of_Intervals := (
  Intervals.of_sound, (* Interval *)
  Intervals.plus_sound, (* Interval *)
  Intervals.minus_sound, (* Interval *)
  Intervals.opposite_sound, (* Interval *)
  Intervals.times_sound, (* Interval *)
  Intervals.over_sound, (* Interval *)
  Intervals.root_sound, (* Interval *)
  Intervals.within_sound). (* Interval *)
Print Assumptions of_Intervals.

Definition of_Sines := (
  Sines.pi_between, (* _cosine_and_sine *)
  Sines.taylor_rounded, (* _cosine_and_sine *)
  Sines.turned, (* _cosine_and_sine *)
  Sines.cosine_near, (* cosine_and_sine *)
  Sines.sine_near_by, (* cosine_and_sine *)
  Sines.beside). (* cosine_and_sine *)
Print Assumptions of_Sines.

Definition of_Rotors := (
  Rotors.speed_kept, (* _asked *)
  Rotors.tilt_kept, (* _asked *)
  Rotors.rate_kept, (* _asked *)
  Rotors.turned_slopes, (* limits *)
  Rotors.body_axes, (* limits *)
  Rotors.rates, (* limits *)
  Rotors.level_rate, (* limits *)
  Rotors.accelerations, (* limits *)
  Rotors.yaw_acceleration, (* limits *)
  Rotors.rotors_share). (* limits *)
Print Assumptions of_Rotors.

Definition of_Instants := (
  Instants.instant_letter). (* places *)
Print Assumptions of_Instants.

Definition of_Progression := (
  Progression.normal_sat, (* formulas *)
  Progression.progress_state_sat, (* formulas *)
  Progression.accepts_sound, (* formulas *)
  Progression.satisfies_correct,
  Progression.stutter, (* team *)
  Progression.cut_letters). (* team *)
Print Assumptions of_Progression.

Definition of_Counts := (
  Counts.counted_between, (* _count *)
  Counts.counted_letters). (* _letters *)
Print Assumptions of_Counts.

Definition of_Invariant := (
  Invariant.check_invariant_sound, (* words *)
  Invariant.check_joint_sound, (* team *)
  Invariant.check_own_sound, (* team *)
  Invariant.read_in_each_cut). (* team *)
Print Assumptions of_Invariant.

Definition of_Endless := (
  Endless.normal_holds,
  Endless.endless_refuted, (* words *)
  Endless.held_letters, (* words *)
  Endless.unwind_open). (* formulas *)
Print Assumptions of_Endless.

Definition of_Laps := (
  Laps.check_laps_sound, (* words *)
  Laps.check_own_laps_sound, (* team *)
  Laps.check_joint_laps_sound). (* team *)
Print Assumptions of_Laps.

Definition of_Clocks := (
  Clocks.order_forced, (* waits *)
  Clocks.orders_exact,
  Clocks.middle_near).
Print Assumptions of_Clocks.

Definition of_Timeline := (
  Timeline.flight_course, (* places *)
  Timeline.flight_begun,
  Timeline.lists_all_permits,
  Timeline.own_allows,
  Timeline.joint_allows,
  Timeline.flight_own, (* team *)
  Timeline.flight_joint). (* team *)
Print Assumptions of_Timeline.
