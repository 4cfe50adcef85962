(** Clocks that differ by at most e: exactly which orders of events they allow.

    Event i happens on robot [who i]'s clock between [lo i] and [hi i].  All clocks
    rise, and at every moment any two differ by at most [e]. *)

Require Import Reals Lra Lia Arith List.
Import ListNotations.
Open Scope R_scope.

Definition rises (c : R -> R) : Prop := forall t u, t <= u -> c t <= c u.

(** Some other event is over by more than e before this one begins. *)
Theorem order_forced : forall A B e hi lo t u,
  rises B -> (forall m, B m <= A m + e) ->
  A t <= hi -> lo <= B u -> hi + e < lo -> t < u.
Proof.
  intros A B e hi lo t u HB D Ha Hb H; apply Rnot_le_lt; intros L.
  specialize (HB u t L); specialize (D t); lra.
Qed.

(** ** The greatest of selected values *)

Fixpoint best (n : nat) (chosen : nat -> Prop) (dec : forall i, {chosen i} + {~ chosen i})
    (f : nat -> R) (base : R) : R :=
  match n with
  | O => base
  | S m => let b := best m chosen dec f base in if dec m then Rmax b (f m) else b
  end.

Section Best.
  Variables (chosen : nat -> Prop) (dec : forall i, {chosen i} + {~ chosen i}) (f : nat -> R).

  Lemma best_base : forall n base, base <= best n chosen dec f base.
  Proof.
    induction n as [|n IH]; intros base; cbn; [lra|]; specialize (IH base).
    destruct (dec n); auto. pose proof (Rmax_l (best n chosen dec f base) (f n)); lra.
  Qed.

  Lemma best_above : forall n base i, (i < n)%nat -> chosen i -> f i <= best n chosen dec f base.
  Proof.
    induction n as [|n IH]; intros base i L C; [lia|]; cbn.
    destruct (Nat.eq_dec i n) as [->|NE].
    - destruct (dec n); [apply Rmax_r | contradiction].
    - assert (f i <= best n chosen dec f base) by (apply IH; auto; lia).
      destruct (dec n); auto. pose proof (Rmax_l (best n chosen dec f base) (f n)); lra.
  Qed.

  Lemma best_least : forall n base k, base <= k ->
    (forall i, (i < n)%nat -> chosen i -> f i <= k) -> best n chosen dec f base <= k.
  Proof.
    induction n as [|n IH]; intros base k B H; cbn; auto.
    assert (best n chosen dec f base <= k) by (apply IH; auto).
    destruct (dec n); auto. apply Rmax_lub; auto.
  Qed.
End Best.

(** ** Orders that clocks allow

    [moment i] says where event i comes in the order; events may share a moment. *)

Section Orders.
  Variables (n : nat) (who : nat -> nat) (moment lo hi : nat -> R) (e : R).
  Hypothesis e_nonneg : 0 <= e.

  (** Events happen so under some clocks. *)
  Definition possible : Prop :=
    exists clock : nat -> R -> R,
      (forall r, rises (clock r)) /\
      (forall r s m, clock r m <= clock s m + e) /\
      (forall i, (i < n)%nat -> lo i <= clock (who i) (moment i) <= hi i).

  (** The rule, pair by pair. *)
  Definition slack (i j : nat) : R := if Nat.eq_dec (who i) (who j) then 0 else e.
  Definition allowed : Prop :=
    forall i j, (i < n)%nat -> (j < n)%nat -> moment i <= moment j -> lo i <= hi j + slack i j.

  Lemma possible_allowed : possible -> allowed.
  Proof.
    intros (clock & Rise & Near & In) i j Hi Hj M.
    pose proof (In i Hi); pose proof (In j Hj).
    pose proof (Rise (who i) _ _ M); pose proof (Near (who i) (who j) (moment j)).
    unfold slack; destruct (Nat.eq_dec (who i) (who j)) as [E|_]; [rewrite E in *|]; lra.
  Qed.

  (** The earliest instants that the enclosures and the order leave. *)
  Definition earlier j i := moment i <= moment j.
  Definition earlier_dec j i : {earlier j i} + {~ earlier j i} := Rle_dec (moment i) (moment j).
  Definition own_earlier j i := who i = who j /\ moment i <= moment j.
  Definition own_earlier_dec j i : {own_earlier j i} + {~ own_earlier j i}.
  Proof.
    unfold own_earlier; destruct (Nat.eq_dec (who i) (who j)), (Rle_dec (moment i) (moment j));
      [left; auto | right; tauto..].
  Defined.

  Definition instant (j : nat) : R :=
    best n (own_earlier j) (own_earlier_dec j) lo
      (best n (earlier j) (earlier_dec j) (fun i => lo i - e) (lo j)).

  Lemma instant_least : forall j k, lo j <= k ->
    (forall i, (i < n)%nat -> moment i <= moment j -> lo i - e <= k) ->
    (forall i, (i < n)%nat -> who i = who j -> moment i <= moment j -> lo i <= k) ->
    instant j <= k.
  Proof.
    intros j k B H K; unfold instant; apply best_least; [apply best_least|]; auto.
    intros i Hi [E M]; auto.
  Qed.

  Lemma instant_base : forall j, lo j <= instant j.
  Proof. intros j; unfold instant; eapply Rle_trans; [|apply best_base]; apply best_base. Qed.

  Lemma instant_any : forall i j, (i < n)%nat -> moment i <= moment j -> lo i - e <= instant j.
  Proof.
    intros i j Hi M; unfold instant; eapply Rle_trans; [|apply best_base].
    apply (best_above (earlier j) (earlier_dec j) (fun i => lo i - e)); auto.
  Qed.

  Lemma instant_own : forall i j, (i < n)%nat -> who i = who j -> moment i <= moment j ->
    lo i <= instant j.
  Proof. intros i j Hi E M; unfold instant; apply best_above; auto; split; auto. Qed.

  Lemma instant_in : allowed -> forall j, (j < n)%nat -> lo j <= instant j <= hi j.
  Proof.
    intros A j Hj; split; [apply instant_base|]; apply instant_least.
    - pose proof (A j j Hj Hj (Rle_refl _)) as H; unfold slack in H.
      destruct (Nat.eq_dec (who j) (who j)); [lra | congruence].
    - intros i Hi M; pose proof (A i j Hi Hj M) as H; unfold slack in H.
      destruct (Nat.eq_dec (who i) (who j)); lra.
    - intros i Hi E M; pose proof (A i j Hi Hj M) as H; unfold slack in H.
      destruct (Nat.eq_dec (who i) (who j)); [lra | congruence].
  Qed.

  Lemma instant_near : forall i j, (i < n)%nat -> moment i <= moment j ->
    instant i <= instant j + e.
  Proof.
    intros i j Hi M; apply instant_least.
    - pose proof (instant_any i j Hi M); lra.
    - intros k Hk Mk; pose proof (instant_any k j Hk); lra.
    - intros k Hk _ Mk; pose proof (instant_any k j Hk); lra.
  Qed.

  Lemma instant_rises : forall i j, (i < n)%nat -> who i = who j -> moment i <= moment j ->
    instant i <= instant j.
  Proof.
    intros i j Hi E M; apply instant_least.
    - apply instant_own; auto.
    - intros k Hk Mk; apply instant_any; auto; lra.
    - intros k Hk Ek Mk; apply instant_own; auto; [congruence | lra].
  Qed.

  (** Clocks that show these instants: each lags behind the foremost by at most e. *)
  Definition bottom : R := - best n (fun _ => True) (fun _ => left I) (fun i => - instant i) 0.
  Definition until m i := moment i <= m.
  Definition until_dec m i : {until m i} + {~ until m i} := Rle_dec (moment i) m.
  Definition mine r m i := who i = r /\ moment i <= m.
  Definition mine_dec r m i : {mine r m i} + {~ mine r m i}.
  Proof.
    unfold mine; destruct (Nat.eq_dec (who i) r), (Rle_dec (moment i) m);
      [left; auto | right; tauto..].
  Defined.

  Definition peak (m : R) : R := best n (until m) (until_dec m) instant bottom.
  Definition clock (r : nat) (m : R) : R :=
    best n (mine r m) (mine_dec r m) instant (peak m - e).

  Lemma bottom_below : forall i, (i < n)%nat -> bottom <= instant i.
  Proof.
    intros i Hi; unfold bottom.
    pose proof (best_above (fun _ => True) (fun _ => left I) (fun i => - instant i) n 0 i Hi I).
    cbn in H; lra.
  Qed.

  Lemma peak_rises : rises peak.
  Proof.
    intros t u L; unfold peak; apply best_least; [apply best_base|].
    intros i Hi M; apply best_above; unfold until in *; auto; lra.
  Qed.

  Lemma clock_rises : forall r, rises (clock r).
  Proof.
    intros r t u L; unfold clock at 1; apply best_least.
    - pose proof (peak_rises t u L); apply Rle_trans with (peak u - e); [lra | apply best_base].
    - intros i Hi [E M]; apply best_above; auto; split; auto; lra.
  Qed.

  Lemma clock_near : forall r s m, clock r m <= clock s m + e.
  Proof.
    intros r s m; assert (peak m - e <= clock s m) by apply best_base.
    assert (clock r m <= peak m); [|lra].
    apply best_least; [lra|]; intros i Hi [E M]; apply best_above; auto.
  Qed.

  Lemma clock_shows : forall i, (i < n)%nat -> clock (who i) (moment i) = instant i.
  Proof.
    intros i Hi; apply Rle_antisym.
    - apply best_least.
      + assert (peak (moment i) <= instant i + e); [|lra].
        apply best_least; [pose proof (bottom_below i Hi); lra|].
        intros j Hj M; apply instant_near; auto.
      + intros j Hj [E M]; apply instant_rises; auto.
    - apply best_above; auto; split; auto; lra.
  Qed.

  (** Clocks allow exactly the orders in which no event comes after, or together
      with, one that begins more than e later (of one robot: later at all). *)
  Theorem orders_exact : possible <-> allowed.
  Proof.
    split; [apply possible_allowed|]; intros A; exists clock.
    split; [apply clock_rises | split; [apply clock_near|]].
    intros i Hi; rewrite clock_shows; auto; apply instant_in; auto.
  Qed.
End Orders.

(** ** A common time halfway between the foremost clock and the last

    Every clock is within e/2 of it, so enclosures widened by e/2 at both ends hold
    the events on one time axis. *)

Section Middle.
  Variables (first : R) (others : list R) (e : R).
  Definition foremost : R := fold_right Rmax first others.
  Definition hindmost : R := fold_right Rmin first others.

  Lemma foremost_one : In foremost (first :: others).
  Proof.
    unfold foremost; induction others as [|x l IH]; [left; auto|]; cbn.
    destruct (Rle_lt_dec x (fold_right Rmax first l));
      [rewrite Rmax_right by lra; destruct IH; auto | rewrite Rmax_left by lra; auto].
  Qed.

  Lemma hindmost_one : In hindmost (first :: others).
  Proof.
    unfold hindmost; induction others as [|x l IH]; [left; auto|]; cbn.
    destruct (Rle_lt_dec x (fold_right Rmin first l));
      [rewrite Rmin_left by lra; auto | rewrite Rmin_right by lra; destruct IH; auto].
  Qed.

  Lemma between : forall x, In x (first :: others) -> hindmost <= x <= foremost.
  Proof.
    unfold foremost, hindmost; induction others as [|y l IH]; intros x H; cbn.
    - destruct H as [<-|[]]; lra.
    - pose proof (Rmin_l y (fold_right Rmin first l)); pose proof (Rmin_r y (fold_right Rmin first l)).
      pose proof (Rmax_l y (fold_right Rmax first l)); pose proof (Rmax_r y (fold_right Rmax first l)).
      destruct H as [<-|[<-|H]]; [|lra|].
      + specialize (IH first (or_introl eq_refl)); lra.
      + specialize (IH x (or_intror H)); lra.
  Qed.

  Theorem middle_near : (forall x y, In x (first :: others) -> In y (first :: others) -> x <= y + e) ->
    forall x, In x (first :: others) -> Rabs (x - (foremost + hindmost) / 2) <= e / 2.
  Proof.
    intros H x Hx; pose proof (between x Hx).
    pose proof (H _ _ foremost_one hindmost_one). apply Rabs_le; lra.
  Qed.
End Middle.
