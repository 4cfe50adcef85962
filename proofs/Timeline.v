(** From flights in real time to the spans that the invariant checker walks over.

    Time is common; each robot's clock differs from it by at most [d].  On its own clock a
    robot is in a place only within that place's window.  Spans follow one another; each end
    belongs to the span before it or to the one after it, so that spans may be half-open, or
    instants and the gaps between them. *)

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

  (** A span begins at [s], with it or just after it; so its end [t] belongs to it or not. *)
  Definition from (i : bool) (s u : R) : Prop := if i then s <= u else s < u.
  Definition upto (j : bool) (t u : R) : Prop := if j then u < t else u <= t.

  (** Spans one after another from [s] to [T]: each with its end, and whether that is the
      next one's. *)
  Inductive spans : R -> bool -> R -> list (Span * (R * bool)) -> Prop :=
    | spans_last : forall p s i t, from i s t ->
        allows p (fun u => from i s u /\ u <= t) -> spans s i t [(p, (t, false))]
    | spans_next : forall p s i t j T ps, s < t \/ (s = t /\ i = true /\ j = false) ->
        allows p (fun u => from i s u /\ upto j t u) -> spans t j T ps ->
        spans s i T ((p, (t, j)) :: ps).

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

  Lemma spans_order : forall s i T ps, spans s i T ps -> s <= T.
  Proof. induction 1 as [p s [|] t H | p s i t j T ps H]; unfold from in *; lra. Qed.

  (** What is so from [u] to the next event, or to the end. *)
  Definition next (T : R) (es : list (R * E)) : R :=
    match es with [] => T | (v, _) :: _ => v end.

  Lemma flight_stay : forall u x es T, flight u x es T ->
    u <= next T es /\ forall w, u <= w <= next T es -> is_at w x.
  Proof. intros u x es T F; inversion F; subst; auto. Qed.

  Lemma flight_later : forall u x es T v, flight u x es T -> u <= v <= next T es ->
    flight v x es T.
  Proof.
    intros u x es T v F L; inversion F; subst; cbn in L; econstructor; eauto; try lra;
      intros w W; match goal with M : forall _, _ -> is_at _ _ |- _ => apply M; lra end.
  Qed.

  Lemma next_late : forall u x es T, flight u x es T -> next T es <= T.
  Proof.
    intros u x es T F; inversion F as [|u' v x' e y es' T' L A H G]; subst; cbn; [lra|].
    apply (flight_late _ _ _ _ G).
  Qed.

  (** A span is entered at one of its times. *)
  Lemma enters : forall t j T ps u x es, spans t j T ps -> flight u x es T -> u <= t ->
    from j t (next T es) ->
    match ps with (q, _) :: _ => may_be q x | [] => False end.
  Proof.
    intros t j T ps u x es P F U N; destruct (flight_stay _ _ _ _ F) as [_ A].
    pose proof (next_late _ _ _ _ F) as B.
    inversion P as [q s' i' t' L [Q _] | q s' i' t' j' T' qs L [Q _]]; subst.
    - apply (Q (next T es)); [split; auto | apply A; destruct j; cbn in N; lra].
    - destruct L as [L | (-> & -> & ->)].
      + set (w := if j then t else Rmin (next T es) ((t + t') / 2)).
        assert (W : from j t w /\ w < t' /\ t <= w <= next T es).
        { unfold w; destruct j; cbn in *; [lra|].
          pose proof (Rmin_l (next T es) ((t + t') / 2)); pose proof (Rmin_r (next T es) ((t + t') / 2)).
          assert (t < Rmin (next T es) ((t + t') / 2)) by (apply Rmin_glb_lt; lra). lra. }
        apply (Q w); [split; [|destruct j'; cbn]; lra || tauto | apply A; lra].
      + cbn in N; apply (Q t'); [cbn; lra | apply A; lra].
  Qed.

  (** What flies in real time is a course of the spans. *)
  Theorem flight_course : forall s i T ps, (forall x, is_at T x -> ends x) -> spans s i T ps ->
    forall es u x, s <= u -> flight u x es T -> from i s (next T es) ->
    match ps with [_] => True | (_, (t, _)) :: _ => u <= t | [] => False end ->
    course _ _ _ may_be does ends (map fst ps) x (map snd es).
  Proof.
    intros s i T ps End P0; revert End.
    induction P0 as [p s i t St [_ D] | p s i t j T ps St [_ D] P IH]; intros End;
      intros es; induction es as [|[v e] es IHes]; intros u x Su F N Ut.
    - constructor; apply End; inversion F; subst; auto with real.
    - inversion F as [|u' v' x' e' y es' T' L A H G]; subst; cbn [map fst snd next] in *.
      pose proof (flight_late _ _ _ _ G); pose proof (flight_now _ _ _ _ G).
      destruct (flight_stay _ _ _ _ G) as [B _].
      apply course_event with y; [apply (D v); auto|].
      apply (IHes v); auto; [destruct i; cbn in *; lra | destruct i; cbn in *; lra].
    - assert (U : u <= t) by (destruct ps as [|[]]; [inversion P | auto]).
      pose proof (spans_order _ _ _ _ P).
      assert (N' : from j t (next T [])).
      { cbn; inversion P as [q s' i' t' L | q s' i' t' j' T' qs L _ P']; subst; auto.
        pose proof (spans_order _ _ _ _ P'); destruct j; cbn; [lra|].
        destruct L as [L | (-> & K & _)]; [lra | discriminate]. }
      pose proof (enters t j T ps u x [] P F U N') as M.
      destruct ps as [|[q [t' j']] ps]; [destruct M|]; cbn; apply course_span; auto.
      apply (IH End [] t x); auto; [lra | apply (flight_later u); auto; cbn; lra|].
      inversion P; subst; auto; destruct ps; auto; lra.
    - destruct ps as [|[q [t' j']] ps]; [inversion P|].
      assert (Dec : upto j t v \/ from j t v)
        by (destruct j; cbn; [destruct (Rlt_le_dec v t) | destruct (Rle_lt_dec v t)]; auto).
      destruct Dec as [Vt|Vt].
      + inversion F as [|u' v' x' e' y es' T' L A H G]; subst; cbn [map fst snd next] in *.
        pose proof (flight_now _ _ _ _ G); destruct (flight_stay _ _ _ _ G) as [B _].
        apply course_event with y; [apply (D v); auto|].
        apply (IHes v); auto; [destruct i; cbn in *; lra | destruct i; cbn in *; lra |].
        destruct j; cbn in Vt; lra.
      + pose proof (enters t j T _ u x _ P F Ut Vt) as M; cbn; apply course_span; auto.
        assert (t <= v) by (destruct j; cbn in Vt; lra).
        apply (IH End ((v, e) :: es) t x); auto; [lra | apply (flight_later u); auto|].
        inversion P; subst; auto; destruct ps; auto; lra.
  Qed.

  Lemma first_span : forall s T ps, spans s true T ps ->
    match ps with [_] => True | (_, (t, _)) :: _ => s <= t | [] => False end.
  Proof. intros s T ps P; inversion P; subst; auto; destruct ps0; auto; lra. Qed.

  (** From its beginning on. *)
  Corollary flight_begun : forall s T ps es x, (forall x, is_at T x -> ends x) ->
    spans s true T ps -> flight s x es T ->
    course _ _ _ may_be does ends (map fst ps) x (map snd es).
  Proof.
    intros s T ps es x End P F; apply (flight_course s true T ps End P es s x); auto; [lra | |].
    - apply (flight_stay _ _ _ _ F).
    - apply (first_span _ _ _ P).
  Qed.
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
    spans _ _ _ own_may_be (own_does robots) (placed windows d) own_happens s true T ps ->
    check_own robots last f starts (map fst ps) is = true ->
    In c starts -> length c = length robots ->
    flight _ _ (placed windows d) own_happens s c es T ->
    own_word robots c (map snd es) <> [] ->
    (forall i, (i < length robots)%nat -> read_in_each robots i false c (map snd es)) ->
    ssat f (own_word robots c (map snd es)).
  Proof.
    intros f starts s T ps is c es End P H I L F N A.
    apply (check_own_sound robots last f starts (map fst ps) is); auto.
    eapply flight_begun; eauto.
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
    spans _ _ _ joint_may_be (joint_does robots) joint_at joint_happens s true T ps ->
    check_joint robots last f starts (map fst ps) is = true ->
    In (a, c) starts -> flight _ _ joint_at joint_happens s (c, a) xs T ->
    ssat f (a :: map snd (map snd xs)).
  Proof.
    intros f starts s T ps is c a xs End P H I F.
    apply (check_joint_sound robots last f starts (map fst ps) is c); auto.
    eapply flight_begun; eauto; intros x [Pl _]; auto.
  Qed.
End Teams.
