(** Print the axioms of each theorem that the kernel rests on. *)

From LtlPlan Require Bernstein Crossing Halves Tree Regions Margins Farkas Progression Invariant Clocks Timeline.

Print Assumptions Bernstein.bern_sum.
Print Assumptions Bernstein.bern_power.
Print Assumptions Bernstein.bern_nonneg.
Print Assumptions Bernstein.bern_positive.
Print Assumptions Bernstein.bern_lower.
Print Assumptions Bernstein.bern_upper.
Print Assumptions Crossing.crossing_in.
Print Assumptions Crossing.crossing_out.
Print Assumptions Halves.first_represents.
Print Assumptions Halves.second_represents.
Print Assumptions Tree.check_tree_sound.
Print Assumptions Tree.tiles_cover.
Print Assumptions Regions.check_region_sound.
Print Assumptions Regions.check_nonneg_sound.
Print Assumptions Regions.must_tube.
Print Assumptions Regions.no_tube.
Print Assumptions Regions.across_face.
Print Assumptions Margins.half_space_must.
Print Assumptions Margins.half_space_no.
Print Assumptions Margins.quadric_must.
Print Assumptions Margins.quadric_no.
Print Assumptions Margins.minors_semidefinite.
Print Assumptions Margins.rows_grow.
Print Assumptions Margins.rest_grows.
Print Assumptions Farkas.farkas_outside.
Print Assumptions Farkas.farkas_keeps.
Print Assumptions Farkas.farkas_ball.
Print Assumptions Progression.normal_sat.
Print Assumptions Progression.progress_state_sat.
Print Assumptions Progression.accepts_sound.
Print Assumptions Progression.satisfies_correct.
Print Assumptions Invariant.check_invariant_sound.
Print Assumptions Invariant.check_joint_sound.
Print Assumptions Invariant.check_own_sound.
Print Assumptions Clocks.order_forced.
Print Assumptions Clocks.orders_exact.
Print Assumptions Clocks.middle_near.
Print Assumptions Timeline.flight_own.
Print Assumptions Timeline.flight_joint.
