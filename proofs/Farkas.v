(** Weights of inequalities part a point, or a ball, from a convex body.

    The body is the set of points at which every function of a list is at most zero. *)

Require Import Reals Lra List Psatz.
From LtlPlan Require Import Vectors.
Import ListNotations.
Open Scope R_scope.

Definition inside {X} (body : list (X -> R)) (x : X) : Prop :=
  forall g, In g body -> g x <= 0.

Fixpoint weighted {X} (weights : list R) (body : list (X -> R)) (x : X) : R :=
  match weights, body with
  | w :: ws, g :: gs => w * g x + weighted ws gs x
  | _, _ => 0
  end.

Definition nonneg (weights : list R) : Prop := Forall (fun w => 0 <= w) weights.

Lemma weighted_inside : forall X weights (body : list (X -> R)) x,
  nonneg weights -> inside body x -> weighted weights body x <= 0.
Proof.
  unfold nonneg; induction weights as [|w ws IH]; intros [|g gs] x HW HB; simpl; try lra.
  inversion HW; subst.
  assert (g x <= 0) by (apply HB; left; auto).
  assert (weighted ws gs x <= 0) by (apply IH; auto; intros k Hk; apply HB; right; auto).
  nra.
Qed.

(** Inequalities of any kind: a positive sum leaves the point outside. *)
Theorem farkas_outside : forall X weights (body : list (X -> R)) x,
  nonneg weights -> 0 < weighted weights body x -> ~ inside body x.
Proof. intros X ws body x HW H HB; pose proof (weighted_inside X ws body x HW HB); lra. Qed.

(** Multipliers for relations: a positive constant below the sum, at every point
    of a set, leaves no point of the set in the body. *)
Theorem farkas_empty : forall X (P : X -> Prop) weights (body : list (X -> R)),
  nonneg weights -> (forall x, P x -> 0 < weighted weights body x) ->
  forall x, P x -> ~ inside body x.
Proof. intros; apply farkas_outside with weights; auto. Qed.

(** Multipliers of which the sum bounds [g] show that the body keeps [g]. *)
Theorem farkas_keeps : forall X weights (body : list (X -> R)) (g : X -> R),
  nonneg weights -> (forall x, g x <= weighted weights body x) ->
  forall x, inside body x -> g x <= 0.
Proof.
  intros X ws body g HW H x HB; specialize (H x).
  pose proof (weighted_inside X ws body x HW HB); lra.
Qed.

(** ** Half-spaces and a ball *)

Definition half_space : Type := vec * R.
Definition slack (f : half_space) (x : vec) : R := dot (fst f) x - snd f.

Definition in_all (faces : list half_space) (x : vec) : Prop :=
  forall f, In f faces -> dot (fst f) x <= snd f.

Fixpoint normal (weights : list R) (faces : list half_space) : vec :=
  match weights, faces with
  | w :: ws, f :: fs => add (scale w (fst f)) (normal ws fs)
  | _, _ => zero
  end.

Fixpoint offset (weights : list R) (faces : list half_space) : R :=
  match weights, faces with
  | w :: ws, f :: fs => w * snd f + offset ws fs
  | _, _ => 0
  end.

Lemma weighted_slack : forall weights faces x,
  weighted weights (map slack faces) x = dot (normal weights faces) x - offset weights faces.
Proof.
  induction weights as [|w ws IH]; intros [|f fs] x; simpl;
    try (unfold dot; simpl; ring).
  rewrite IH; unfold slack, dot, add, scale; simpl; ring.
Qed.

Lemma in_all_inside : forall faces x, in_all faces x -> inside (map slack faces) x.
Proof.
  intros faces x H g Hg; apply in_map_iff in Hg as (f & <- & Hf).
  unfold slack; specialize (H f Hf); lra.
Qed.

(** The ball of radius [r] around [p] and the body share no point. *)
Theorem farkas_ball : forall weights faces N r p,
  nonneg weights -> 0 <= N -> 0 <= r ->
  dot (normal weights faces) (normal weights faces) <= N * N ->
  offset weights faces + N * r < dot (normal weights faces) p ->
  forall q, near r p q -> ~ in_all faces q.
Proof.
  intros ws faces N r p HW HN Hr Hn H q Hq HB.
  apply in_all_inside in HB.
  pose proof (weighted_inside _ ws _ q HW HB) as L; rewrite weighted_slack in L.
  pose proof (reach _ N r p q HN Hn Hr Hq); lra.
Qed.
