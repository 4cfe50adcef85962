(** From flights in real time to the spans that the invariant checker walks over.

    Time is common; each robot's clock differs from it by at most [d].  On its own clock a
    robot is in a place only within that place's window.  Spans are half-open, [s, t), and
    the last one is closed. *)

Require Import Reals Lra List Bool.
From LtlPlan Require Import Progression Invariant.
Import ListNotations.
Open Scope R_scope.

Section Timeline.
  Variables (X E Span : Type).
  (** What is so in a span, as the checker has it, and at a time. *)
  Variable may_be : Span -> X -> Prop.
  Variable does : Span -> X -> E -> X -> Prop.
  Variable ends : X -> Prop.
  Variable is_at : R -> X -> Prop.
  Variable happens : R -> X -> E -> X -> Prop.

  (** The checker's span allows all that is so at the times of a set. *)
  Definition allows (p : Span) (times : R -> Prop) : Prop :=
    (forall u x, times u -> is_at u x -> may_be p x) /\
    (forall u x e y, times u -> happens u x e y -> is_at u y -> does p x e y).

  (** Spans with their ends, one after another from [s] to [T]. *)
  Inductive spans : R -> R -> list (Span * R) -> Prop :=
    | spans_last : forall p s t, s <= t ->
        allows p (fun u => s <= u <= t) -> spans s t [(p, t)]
    | spans_next : forall p s t T ps, s < t ->
        allows p (fun u => s <= u < t) -> spans t T ps -> spans s T ((p, t) :: ps).

  (** From [u] on it is so, until the next event; [T] is the end. *)
  Inductive flight : R -> X -> list (R * E) -> R -> Prop :=
    | flight_end : forall u x T, u <= T ->
        (forall v, u <= v <= T -> is_at v x) -> flight u x [] T
    | flight_event : forall u v x e y es T, u <= v ->
        (forall w, u <= w <= v -> is_at w x) -> happens v x e y ->
        flight v y es T -> flight u x ((v, e) :: es) T.

  Lemma flight_now : forall u x es T, flight u x es T -> is_at u x.
  Proof. intros u x es T F; inversion F; subst; auto using Rle_refl. Qed.

  Lemma flight_late : forall u x es T, flight u x es T -> u <= T.
  Proof. induction 1; lra. Qed.

  Lemma spans_order : forall s T ps, spans s T ps -> s <= T.
  Proof. induction 1; lra. Qed.

  (** The same flight, seen from a later moment of its stay. *)
  Lemma flight_later : forall u x es T v, flight u x es T -> u <= v ->
    match es with [] => v <= T | (w, _) :: _ => v <= w end -> flight v x es T.
  Proof.
    intros u x es T v F L B; inversion F; subst; econstructor; eauto; intros w W;
      match goal with M : forall _, _ -> is_at _ _ |- _ => apply M; lra end.
  Qed.

  Lemma enters : forall t T ps x, spans t T ps -> is_at t x ->
    match ps with (q, _) :: _ => may_be q x | [] => False end.
  Proof.
    intros t T ps x P A; inversion P as [q s' t' L [Q _] | q s' t' T' qs L [Q _]]; subst;
      apply (Q t); auto; lra.
  Qed.

  (** What flies in real time is a course of the spans. *)
  Theorem flight_course : forall s T ps, (forall x, is_at T x -> ends x) -> spans s T ps ->
    forall es u x, s <= u -> flight u x es T ->
    match ps with [_] => True | (_, t) :: _ => u < t | [] => False end ->
    course _ _ _ may_be does ends (map fst ps) x (map snd es).
  Proof.
    intros s T ps End P0; revert End.
    induction P0 as [p s t St [_ D] | p s t T ps St [_ D] P IH]; intros End;
      intros es; induction es as [|[v e] es IHes]; intros u x Su F Ut.
    - constructor; apply End; inversion F; subst; auto with real.
    - inversion F as [|u' v' x' e' y es' T' L A H G]; subst; cbn.
      pose proof (flight_late _ _ _ _ G); pose proof (flight_now _ _ _ _ G).
      apply course_event with y; [apply (D v); auto; lra | apply (IHes v); auto; lra].
    - assert (G : flight t x [] T) by
        (apply (flight_later u); [auto | destruct ps as [|[]]; [inversion P | lra]
          | apply (spans_order _ _ _ P)]).
      pose proof (enters t T ps x P (flight_now _ _ _ _ G)) as M.
      destruct ps as [|[q t'] ps]; [destruct M|]; cbn; apply course_span; auto.
      apply (IH End [] t x); auto; [lra|]; inversion P; subst; auto; destruct ps; auto.
    - destruct ps as [|[q t'] ps]; [inversion P|].
      destruct (Rlt_le_dec v t) as [Vt|Vt].
      + inversion F as [|u' v' x' e' y es' T' L A H G]; subst; cbn.
        pose proof (flight_now _ _ _ _ G).
        apply course_event with y; [apply (D v); auto; lra | apply (IHes v); auto; lra].
      + assert (G : flight t x ((v, e) :: es) T) by (apply (flight_later u); auto; lra).
        pose proof (enters t T _ x P (flight_now _ _ _ _ G)) as M; cbn; apply course_span; auto.
        apply (IH End ((v, e) :: es) t x); auto; [lra|]; inversion P; subst; auto; destruct ps; auto.
  Qed.

  Lemma first_span : forall s T ps, spans s T ps ->
    match ps with [_] => True | (_, t) :: _ => s < t | [] => False end.
  Proof. intros s T ps P; inversion P; subst; auto; destruct ps0; auto. Qed.
End Timeline.

(** ** Places: windows on each robot's own clock *)

Section Windows.
  Variable windows : list (nat -> R * R).
  Variable d : R.

  (** Where the robots may be at common time [u]. *)
  Definition placed (u : R) (c : places) : Prop :=
    Forall2 (fun w q => exists x, Rabs (x - u) <= d /\ fst (w q) <= x <= snd (w q)) windows c.

  (** A list of each place whose widened window holds some of the times. *)
  Definition lists_all (p : list (list nat)) (times : R -> Prop) : Prop :=
    Forall2 (fun w l => forall u q, times u -> fst (w q) - d <= u <= snd (w q) + d ->
      member q l = true) windows p.

  Theorem lists_all_permits : forall p times u c,
    lists_all p times -> times u -> placed u c -> permitted p c = true.
  Proof.
    unfold lists_all, placed; intros p times u c L; revert c.
    induction L as [|w l ws ps H L IH]; intros c U M; inversion M as [|w' q ws' c' Hq Mc]; subst;
      auto; cbn; apply andb_true_iff; split; [|apply IH; auto].
    destruct Hq as (x & X & W).
    pose proof (Rle_abs (x - u)); pose proof (Rle_abs (- (x - u))) as A; rewrite Rabs_Ropp in A.
    apply (H u); auto; lra.
  Qed.
End Windows.

(** ** Teams in real time *)

Section Teams.
  Variables (robots : list robot) (windows : list (nat -> R * R)) (d : R).
  Variable last : places -> bool.

  (** Own letters; [others u a]: a robot that is not followed may show [a] at [u]. *)
  Variable others : R -> letter -> Prop.

  Definition own_happens (u : R) (c : places) (e : event) (c' : places) : Prop :=
    match e with
    | Read i => c' = c /\ (i < length robots)%nat
    | ReadOther a => c' = c /\ others u a
    | Change x => c' = x /\ changed robots c x
    end.

  Definition own_lists (p : own_span) (times : R -> Prop) : Prop :=
    lists_all windows d (fst p) times /\ forall u a, times u -> others u a -> In a (snd p).

  Lemma own_allows : forall p times, own_lists p times ->
    allows _ _ _ own_may_be (own_does robots) (placed windows d) own_happens p times.
  Proof.
    intros p times [L O]; split.
    - intros u c U M; apply (lists_all_permits windows d (fst p) times u); auto.
    - intros u c [i | a | x] y U H M; cbn in *; destruct H as [-> H]; repeat split; eauto.
      apply (lists_all_permits windows d (fst p) times u); auto.
  Qed.

  Theorem flight_own : forall f starts s T ps is c es,
    (forall x, placed windows d T x -> last x = true) ->
    spans _ _ _ own_may_be (own_does robots) (placed windows d) own_happens s T ps ->
    check_own robots last f starts (map fst ps) is = true ->
    In c starts -> length c = length robots ->
    flight _ _ (placed windows d) own_happens s c es T ->
    own_word robots c (map snd es) <> [] ->
    (forall i, (i < length robots)%nat -> read_in_each robots i false c (map snd es)) ->
    ssat f (own_word robots c (map snd es)).
  Proof.
    intros f starts s T ps is c es End P H I L F N A.
    apply (check_own_sound robots last f starts (map fst ps) is); auto.
    eapply flight_course; eauto; [lra | eapply first_span; eauto].
  Qed.

  (** Joint letters; [team u c a]: the team may show [a] at [u], its robots being at [c]. *)
  Variable team : R -> places -> letter -> Prop.

  Definition joint_at (u : R) (x : places * letter) : Prop :=
    placed windows d u (fst x) /\ team u (fst x) (snd x).
  Definition joint_happens (u : R) (x y z : places * letter) : Prop :=
    z = y /\ changed robots (fst x) (fst y).

  Definition joint_lists (p : joint_span) (times : R -> Prop) : Prop :=
    lists_all windows d (fst p) times /\ forall u c a, times u -> team u c a -> In a (snd p c).

  Lemma joint_allows : forall p times, joint_lists p times ->
    allows _ _ _ joint_may_be (joint_does robots) joint_at joint_happens p times.
  Proof.
    intros p times [L O].
    assert (M : forall u x, times u -> joint_at u x -> joint_may_be p x).
    { intros u x U [Pl A]; split; eauto. apply (lists_all_permits windows d (fst p) times u); auto. }
    split; auto. intros u x y z U [-> H] A; repeat split; auto; apply (M u y U A).
  Qed.

  Theorem flight_joint : forall f starts s T ps is c a xs,
    (forall x, placed windows d T x -> last x = true) ->
    spans _ _ _ joint_may_be (joint_does robots) joint_at joint_happens s T ps ->
    check_joint robots last f starts (map fst ps) is = true ->
    In (a, c) starts -> flight _ _ joint_at joint_happens s (c, a) xs T ->
    ssat f (a :: map snd (map snd xs)).
  Proof.
    intros f starts s T ps is c a xs End P H I F.
    apply (check_joint_sound robots last f starts (map fst ps) is c); auto.
    eapply flight_course; eauto; [intros x [Pl _]; auto | lra | eapply first_span; eauto].
  Qed.
End Teams.
