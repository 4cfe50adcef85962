(** From flights in real time to the spans that the invariant checker walks over.

    Time is common; each robot's clock differs from it by at most [d].  On its own
    clock a robot is in a place only within that place's window. *)

Require Import Reals Lra List Bool.
From LtlPlan Require Import Progression Invariant.
Import ListNotations.
Open Scope R_scope.

Definition window : Type := R * R.

Section Timeline.
  Variable robots : list robot.
  Variable windows : list (nat -> window).
  Variable d : R.

  (** Where the robots may be at common time [u]. *)
  Definition may_be (u : R) (c : places) : Prop :=
    Forall2 (fun w q => exists x, Rabs (x - u) <= d /\ fst (w q) <= x <= snd (w q)) windows c.

  (** A span from [s] to [t] lists each place whose widened window meets it. *)
  Definition lists_all (p : span) (s t : R) : Prop :=
    Forall2 (fun w l => forall q, fst (w q) - d <= t -> s <= snd (w q) + d -> member q l = true)
      windows p.

  Lemma lists_all_permits : forall p s t u c,
    lists_all p s t -> s <= u <= t -> may_be u c -> permitted p c = true.
  Proof.
    unfold lists_all, may_be; intros p s t u c L; revert c.
    induction L as [|w l ws ps H L IH]; intros c U M; inversion M as [|w' q ws' c' Hq Mc]; subst;
      auto; cbn; apply andb_true_iff; split; [|apply IH; auto].
    destruct Hq as (x & X & W).
    pose proof (Rle_abs (x - u)); pose proof (Rle_abs (- (x - u))) as A; rewrite Rabs_Ropp in A.
    apply H; lra.
  Qed.

  (** Spans with their ends, one after another from [s] to [T]. *)
  Inductive spans : R -> R -> list (span * R) -> Prop :=
    | spans_last : forall p s t, s <= t -> lists_all p s t -> spans s t [(p, t)]
    | spans_next : forall p s t T ps, s <= t -> lists_all p s t ->
        spans t T ps -> spans s T ((p, t) :: ps).

  (** From [u] on the robots are at [c], until the next event; [T] is the end. *)
  Inductive flight : R -> places -> list (R * event) -> R -> Prop :=
    | flight_end : forall u c T, u <= T ->
        (forall v, u <= v <= T -> may_be v c) -> flight u c [] T
    | flight_read : forall u v c i es T, u <= v ->
        (forall x, u <= x <= v -> may_be x c) -> (i < length robots)%nat ->
        flight v c es T -> flight u c ((v, Read i) :: es) T
    | flight_change : forall u v c c' es T, u <= v ->
        (forall x, u <= x <= v -> may_be x c) -> changed robots c c' ->
        flight v c' es T -> flight u c ((v, Change c') :: es) T.

  Lemma flight_now : forall u c es T, flight u c es T -> may_be u c.
  Proof. intros u c es T F; inversion F; subst; auto using Rle_refl. Qed.

  Lemma flight_late : forall u c es T, flight u c es T -> u <= T.
  Proof. induction 1; lra. Qed.

  Lemma spans_order : forall s T ps, spans s T ps -> s <= T.
  Proof. induction 1; lra. Qed.

  (** The same flight, seen from a later moment of its stay at [c]. *)
  Lemma flight_later : forall u c es T v, flight u c es T -> u <= v ->
    match es with [] => v <= T | (x, _) :: _ => v <= x end -> flight v c es T.
  Proof.
    intros u c es T v F L B; inversion F; subst; constructor; auto; intros x X;
      match goal with M : forall _, _ -> may_be _ _ |- _ => apply M; lra end.
  Qed.

  Lemma hand_over : forall p t T ps c es, spans t T ps -> flight t c es T ->
    own_course robots (map fst ps) c (map snd es) ->
    own_course robots (p :: map fst ps) c (map snd es).
  Proof.
    intros p t T ps c es P F C.
    assert (M : may_be t c) by apply (flight_now _ _ _ _ F).
    inversion P as [q s' t' St L | q s' t' T' qs St L]; subst; cbn in *;
      apply own_span; auto; apply (lists_all_permits q t t' t) || apply (lists_all_permits q t T t);
      auto; lra.
  Qed.

  (** What flies in real time is a course of the spans. *)
  Theorem flight_course : forall s T ps, spans s T ps ->
    forall es u c, s <= u -> flight u c es T ->
    match ps with (_, t) :: _ => u <= t | [] => False end ->
    own_course robots (map fst ps) c (map snd es).
  Proof.
    induction 1 as [p s t St L | p s t T ps St L P IH];
      intros es; induction es as [|[v e] es IHes]; intros u c Su F Ut.
    - constructor.
    - inversion F; subst; cbn;
        match goal with G : flight v _ es _ |- _ =>
          pose proof (flight_late _ _ _ _ G); pose proof (flight_now _ _ _ _ G) end;
        constructor; auto; try (apply (IHes v); auto; lra).
      apply (lists_all_permits p s t v); auto; lra.
    - assert (G : flight t c [] T)
        by (apply (flight_later u); auto; apply (spans_order _ _ _ P)).
      apply (hand_over p t T ps c []); auto.
      apply (IH [] t c); auto; [lra|]; inversion P; auto.
    - destruct (Rle_lt_dec v t) as [Vt|Vt].
      + inversion F; subst; cbn;
          match goal with G : flight v _ es _ |- _ =>
            pose proof (flight_now _ _ _ _ G) end;
          constructor; auto; try (apply (IHes v); auto; lra).
        apply (lists_all_permits p s t v); auto; lra.
      + assert (G : flight t c ((v, e) :: es) T) by (apply (flight_later u); auto; lra).
        apply (hand_over p t T ps c ((v, e) :: es)); auto.
        apply (IH ((v, e) :: es) t c); auto; [lra|]; inversion P; auto.
  Qed.

  Theorem flight_own : forall f starts s T ps is c es,
    spans s T ps -> check_own robots f starts (map fst ps) is = true ->
    In c starts -> length c = length robots -> robots <> [] ->
    flight s c es T ->
    (forall i, (i < length robots)%nat -> read_in_each robots i false c (map snd es)) ->
    ssat f (own_word robots c (map snd es)).
  Proof.
    intros f starts s T ps is c es P H I N R F A.
    apply (check_own_sound robots f starts (map fst ps) is); auto.
    apply (flight_course s T ps P es s c); auto; [lra | inversion P; auto].
  Qed.

  (** Under joint letters nobody is read: the team's letter is, at every instant. *)
  Fixpoint changes_of (es : list event) : list places :=
    match es with
    | [] => []
    | Read _ :: r => changes_of r
    | Change c :: r => c :: changes_of r
    end.

  Lemma own_joint : forall ps c es, own_course robots ps c es ->
    joint_course robots ps c (changes_of es).
  Proof. induction 1; cbn; auto; constructor; auto. Qed.

  Theorem flight_joint : forall team_letter f starts s T ps is c es,
    spans s T ps -> check_joint team_letter robots f starts (map fst ps) is = true ->
    In c starts -> flight s c es T ->
    ssat f (map (joint_letter team_letter robots) (c :: changes_of (map snd es))).
  Proof.
    intros team f starts s T ps is c es P H I F.
    apply (check_joint_sound team robots f starts (map fst ps) is); auto.
    apply own_joint, (flight_course s T ps P es s c); auto; [lra | inversion P; auto].
  Qed.
End Timeline.
